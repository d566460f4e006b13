#include "host/verbs/tune/key_reader.h"

#include <gtest/gtest.h>

#include <string>

namespace tagwrench {
namespace {

/// One letter a key: u d l r for arrows, E enter, X erase, ! escape, C stop, characters as they
/// are.
std::string told(std::string_view bytes) {
  std::string text;
  for (const Key key : keys_in(bytes))
    text += key.kind == Key::Kind::character ? key.character
                                             : "?udlrEX!C"[static_cast<std::size_t>(key.kind)];
  return text;
}

TEST(KeysIn, ArrowsComeAsTerminalsSendThem) {
  EXPECT_EQ(told("\x1b[A\x1b[B\x1b[C\x1b[D"), "udrl");
  EXPECT_EQ(told("\x1bOA\x1bOB"), "ud") << "a keypad in application mode";
  EXPECT_EQ(told("\x1b[1;2C"), "r") << "with shift";
}

TEST(KeysIn, OthersAreLettersOrLeftOut) {
  EXPECT_EQ(told("s q\r\n\x7f\b\x03"), "s qEEXXC");
  EXPECT_EQ(told("\x1b"), "!");
  EXPECT_EQ(told("\x1bq"), "!q");
  EXPECT_EQ(told("a\x1b[3~b\x1b[Hc"), "abc") << "delete and home";
  EXPECT_EQ(told("\x1b[1;"), "") << "cut off";
  EXPECT_EQ(told("\xc3\xa4\x01z"), "z");
}

}  // namespace
}  // namespace tagwrench
