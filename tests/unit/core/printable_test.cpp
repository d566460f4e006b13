#include "host/core/printable.h"

#include <gtest/gtest.h>

#include <array>

namespace tagwrench {
namespace {

TEST(Printable, TextOfAnyLanguageStaysAsItIs) {
  for (const char* text : {"", "HD Webcam C920", "Kraftsensor \xc3\xa4 5 \xc2\xb5m",
                           "\xe5\x8a\x9b\xe8\xa6\x9a", "\xf0\x9f\xa7\xb2"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, WhatATerminalWouldObeyIsSpeltOut) {
  EXPECT_EQ(printable("a\x1b[2Jb"), "a\\x1b[2Jb");
  EXPECT_EQ(printable("a\r\n\tb\x7f"), "a\\x0d\\x0a\\x09b\\x7f");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "\\xc2\\x9b31m")
      << "C1's CSI";
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "gpj.exe"),
            "\\xe2\\x80\\xaegpj.exe")
      << "right to left";
  EXPECT_EQ(printable("\xe2\x80\xa8"), "\\xe2\\x80\\xa8") << "a line's end";
}

TEST(Printable, BytesThatAreNotUtf8AreSpeltOut) {
  EXPECT_EQ(printable("\x9b"), "\\x9b");
  EXPECT_EQ(printable("\xc3"), "\\xc3") << "cut";
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b") << "longer than it need be";
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "half of a pair";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond U+10FFFF";
  EXPECT_EQ(printable("\xff!"), "\\xff!");
}

TEST(Printable, IsCutBetweenCharactersWhereThereIsNoRoom) {
  std::array<char, 5> room{};
  const auto written = [&](std::string_view text) {
    return std::string(room.data(), write_printable(room, text));
  };
  EXPECT_EQ(written("abcdef"), "abcde");
  EXPECT_EQ(written("abcd\xc3\xa4"), "abcd");
  EXPECT_EQ(written("ab\x1b"), "ab");
  EXPECT_EQ(written("a\x1b"), "a\\x1b");
}

}  // namespace
}  // namespace tagwrench
