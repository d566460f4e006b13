#include <gtest/gtest.h>

#include "host/web/server/request_guard.h"

namespace tagwrench {
namespace {

TEST(WebRequestTest, ARequestIsTakenApart) {
  const PageMessage request =
      parse_page_message(R"({"id":17,"ask":"try","name":"cad","text":"a: 1\n"})");
  EXPECT_EQ(request.fault, "");
  EXPECT_EQ(request.id, 17);
  EXPECT_EQ(request.what, "try");
  EXPECT_EQ(request.arguments, (nlohmann::json{{"name", "cad"}, {"text", "a: 1\n"}}));
}

TEST(WebRequestTest, ARequestWithoutArgumentsHasAnEmptyObject) {
  EXPECT_EQ(parse_page_message(R"({"ask":"zero","id":0})").arguments, nlohmann::json::object());
}

TEST(WebRequestTest, WithoutAnIdNobodyIsAnswered) {
  for (const char* text :
       {"", "x", "null", "17", "[]", "\"zero\"", "{}", R"({"ask":"zero"})",
        R"({"id":"1","ask":"zero"})", R"({"id":1.5,"ask":"zero"})", R"({"id":-1,"ask":"zero"})",
        R"({"id":1e400,"ask":"zero"})", R"({"id":18446744073709551615,"ask":"zero"})",
        R"({"id":9007199254740993,"ask":"zero"})",
        R"({"id":1,"ask":"zero"})"
        "x",
        R"({"id":1,"ask":"zero")", R"({'id':1})", "{\"id\":1,\"ask\":\"\xff\"}"}) {
    const PageMessage request = parse_page_message(text);
    EXPECT_FALSE(request.id) << text;
    EXPECT_NE(request.fault, "") << text;
  }
}

TEST(WebRequestTest, WithAnIdTheFaultIsTold) {
  for (const char* text :
       {R"({"id":1})", R"({"id":1,"ask":7})", R"({"id":1,"ask":""})", R"({"id":1,"ask":"Zero"})",
        R"({"id":1,"ask":"ze ro"})", R"({"id":1,"ask":"../x"})",
        R"({"id":1,"ask":"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"})"}) {
    const PageMessage request = parse_page_message(text);
    EXPECT_EQ(request.id, 1) << text;
    EXPECT_NE(request.fault, "") << text;
  }
}

TEST(WebRequestTest, DeepNestsAreNotEvenParsed) {
  EXPECT_EQ(parse_page_message(R"({"id":1,"ask":"x","a":[[[[[[1]]]]]]})").fault, "");
  EXPECT_EQ(parse_page_message(R"({"id":1,"ask":"x","a":[[[[[[[[1]]]]]]]]})").fault,
            "nested too deeply");
  EXPECT_EQ(parse_page_message(std::string(20'000, '[')).fault, "nested too deeply");
  EXPECT_EQ(parse_page_message(R"({"id":1,"ask":"x","a":"[[[[[[[[[[\"[[[["})").fault, "");
}

TEST(WebRequestTest, ArgumentsAreCounted) {
  nlohmann::json many{{"id", 1}, {"ask", "x"}};
  for (std::size_t i = 0; i < PageMessage::kMaxArguments; ++i) many["a" + std::to_string(i)] = 0;
  EXPECT_EQ(parse_page_message(many.dump()).fault, "");
  many["one_more"] = 0;
  EXPECT_NE(parse_page_message(many.dump()).fault, "");
}

}  // namespace
}  // namespace tagwrench
