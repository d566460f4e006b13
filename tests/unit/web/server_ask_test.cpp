#include <gtest/gtest.h>

#include "host/web/server/ask_message.h"

namespace tagwrench {
namespace {

TEST(WebAsk, AWishIsTakenApart) {
  const AskMessage ask = parse_ask(R"({"id":17,"ask":"try","name":"cad","text":"a: 1\n"})");
  EXPECT_EQ(ask.fault, "");
  EXPECT_EQ(ask.id, 17);
  EXPECT_EQ(ask.what, "try");
  EXPECT_EQ(ask.arguments, (nlohmann::json{{"name", "cad"}, {"text", "a: 1\n"}}));
}

TEST(WebAsk, AWishWithoutArgumentsHasAnEmptyObject) {
  EXPECT_EQ(parse_ask(R"({"ask":"zero","id":0})").arguments, nlohmann::json::object());
}

TEST(WebAsk, WithoutAnIdNobodyIsAnswered) {
  for (const char* text :
       {"", "x", "null", "17", "[]", "\"zero\"", "{}", R"({"ask":"zero"})",
        R"({"id":"1","ask":"zero"})", R"({"id":1.5,"ask":"zero"})", R"({"id":-1,"ask":"zero"})",
        R"({"id":1e400,"ask":"zero"})", R"({"id":18446744073709551615,"ask":"zero"})",
        R"({"id":9007199254740993,"ask":"zero"})",
        R"({"id":1,"ask":"zero"})"
        "x",
        R"({"id":1,"ask":"zero")", R"({'id':1})", "{\"id\":1,\"ask\":\"\xff\"}"}) {
    const AskMessage ask = parse_ask(text);
    EXPECT_FALSE(ask.id) << text;
    EXPECT_NE(ask.fault, "") << text;
  }
}

TEST(WebAsk, WithAnIdTheFaultIsTold) {
  for (const char* text :
       {R"({"id":1})", R"({"id":1,"ask":7})", R"({"id":1,"ask":""})", R"({"id":1,"ask":"Zero"})",
        R"({"id":1,"ask":"ze ro"})", R"({"id":1,"ask":"../x"})",
        R"({"id":1,"ask":"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"})"}) {
    const AskMessage ask = parse_ask(text);
    EXPECT_EQ(ask.id, 1) << text;
    EXPECT_NE(ask.fault, "") << text;
  }
}

TEST(WebAsk, DeepNestsAreNotEvenParsed) {
  EXPECT_EQ(parse_ask(R"({"id":1,"ask":"x","a":[[[[[[1]]]]]]})").fault, "");
  EXPECT_EQ(parse_ask(R"({"id":1,"ask":"x","a":[[[[[[[[1]]]]]]]]})").fault, "nested too deeply");
  EXPECT_EQ(parse_ask(std::string(20'000, '[')).fault, "nested too deeply");
  EXPECT_EQ(parse_ask(R"({"id":1,"ask":"x","a":"[[[[[[[[[[\"[[[["})").fault, "");
}

TEST(WebAsk, ArgumentsAreCounted) {
  nlohmann::json many{{"id", 1}, {"ask", "x"}};
  for (std::size_t i = 0; i < AskMessage::kMostArguments; ++i) many["a" + std::to_string(i)] = 0;
  EXPECT_EQ(parse_ask(many.dump()).fault, "");
  many["one_more"] = 0;
  EXPECT_NE(parse_ask(many.dump()).fault, "");
}

}  // namespace
}  // namespace tagwrench
