#include "protocol/codec.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/unit/protocol/guarded_bytes.h"
#include "tests/unit/protocol/nanopb_codec.h"
#include "tests/unit/protocol/random_messages.h"

namespace tagwrench::link {
namespace {

template <class Message>
bool decode_bytes(const Bytes& bytes, Message& message) {
  GuardedBytes guarded{bytes};
  return decode(guarded.data(), guarded.count(), message);
}

Bytes message_of(const Bytes& body) { return Bytes(body.begin() + kHeaderBytes, body.end()); }

/// `visit(Type{}, kind, name)` for every message type.
template <class Visit>
void each_type(Visit visit) {
  Examples{}.each([&]<class Message>(Kind kind, const char* name, const Message&) {
    visit(Message{}, kind, name);
  });
}

TEST(Codec, EveryKindComesBackAsItWasSent) {
  Examples{}.each([]<class Message>(Kind kind, const char* name, const Message& message) {
    const Bytes body = body_of(message, 0xC3);
    EXPECT_EQ(body[0], static_cast<std::uint8_t>(kind)) << name;
    EXPECT_EQ(body[1], 0xC3) << name;
    Message back;
    EXPECT_TRUE(decode_bytes(message_of(body), back)) << name;
    EXPECT_TRUE(same(message, back)) << name;
  });
}

TEST(Codec, EveryKindComesBackFromTheEndsOfItsRange) {
  each_type([]<class Message>(Message, Kind, const char* name) {
    RandomMessages random{4};
    for (int n = 0; n < 3000; ++n) {
      const Message message = random.make<Message>();
      GuardedBytes body{Bytes(kMaxBodyBytes)};
      const std::uint8_t count = encode(message, 0, body.data());
      ASSERT_LE(count, kMaxBodyBytes) << name;
      Message back;
      ASSERT_TRUE(decode(body.data() + kHeaderBytes, static_cast<std::uint8_t>(count - 2), back))
          << name;
      ASSERT_TRUE(same(message, back)) << name;
    }
  });
}

TEST(Codec, AnEmptyMessageIsAllZero) {
  each_type([]<class Message>(Message zero, Kind, const char* name) {
    EXPECT_EQ(body_of(zero, 5).size(), kHeaderBytes) << name;
    Message back;
    EXPECT_TRUE(decode(nullptr, 0, back)) << name;
    EXPECT_TRUE(same(zero, back)) << name;
  });
}

TEST(Codec, HandEncodersWriteTheBytesOfNanopb) {
  int types = 0;
  each_type([&]<class Message>(Message, Kind, const char* name) {
    if constexpr (Report<Message>) {
      ++types;
      RandomMessages random{5};
      for (int n = 0; n < 20000; ++n) {
        const auto sequence = static_cast<std::uint8_t>(n);
        const Message message = random.make<Message>();
        ASSERT_EQ(body_of(message, sequence), nanopb_body(message, sequence)) << name;
      }
    }
  });
  EXPECT_EQ(types, 10);
}

TEST(Codec, HandEncodersWriteTheBytesOfNanopbWhereTheLengthOfANumberChanges) {
  for (int bit = 0; bit < 32; ++bit) {
    for (const int step : {-1, 0, 1}) {
      const std::uint32_t value = (1u << bit) + static_cast<std::uint32_t>(step);
      for (const bool negative : {false, true}) {
        CellSample cell{};
        cell.counts = static_cast<std::int32_t>(negative ? -value : value);
        cell.time_us = value;
        cell.sequence = static_cast<std::uint16_t>(value);
        cell.missed = static_cast<std::uint16_t>(value);
        cell.saturated = negative;
        ASSERT_EQ(body_of(cell, 0), nanopb_body(cell, 0)) << value;
        TareResult tare{};
        tare.spread_counts = value;
        ASSERT_EQ(body_of(tare, 0), nanopb_body(tare, 0)) << value;
      }
    }
  }
}

TEST(Codec, HandDecodersReadAndRefuseWhatNanopbDoes) {
  int types = 0;
  Examples{}.each([&]<class Message>(Kind, const char* name, const Message& example) {
    if constexpr (Request<Message>) {
      ++types;
      const Bytes bytes = message_of(body_of(example, 0));
      for (std::size_t at = 0; at <= bytes.size(); ++at) {
        const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
        ASSERT_TRUE(decodes_as_nanopb<Message>(cut)) << name;
        for (int byte = 0; byte < 256; ++byte) {
          Bytes longer = bytes;
          longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(at),
                        static_cast<std::uint8_t>(byte));
          ASSERT_TRUE(decodes_as_nanopb<Message>(longer)) << name;
          if (at == bytes.size()) continue;
          Bytes other = bytes;
          other[at] = static_cast<std::uint8_t>(byte);
          ASSERT_TRUE(decodes_as_nanopb<Message>(other)) << name;
        }
      }
      RandomMessages random{7};
      for (int n = 0; n < 5000; ++n) {
        ASSERT_TRUE(decodes_as_nanopb<Message>(message_of(body_of(random.make<Message>(), 0))));
      }
    }
  });
  EXPECT_EQ(types, 6);
}

TEST(Codec, OfAFieldThatIsThereTwiceTheLastCounts) {
  SetId set_id;
  ASSERT_TRUE(decode_bytes({0x0A, 0x03, 1, 2, 3, 0x0A, 0x01, 9}, set_id));
  const SetId last{{.bytes = {9}, .count = 1}};
  EXPECT_TRUE(same(set_id, last));
}

TEST(Codec, AMessageIsReadToItsEnd) {
  TimeRequest request;
  EXPECT_TRUE(decode_bytes({0x08, 0x01, 0x10, 0x01}, request));
  EXPECT_FALSE(decode_bytes({0x08, 0x01, 0x10}, request));
}

TEST(Codec, HandDecodersReadListsThatAreNotPacked) {
  Configure configure;
  ASSERT_TRUE(decode_bytes({0x10, 0x01, 0x12, 0x02, 0x02, 0x03, 0x10, 0x01}, configure));
  EXPECT_EQ(configure.cell_count, 4);
  EXPECT_EQ(configure.cells[2], CellInput::a64);
  EXPECT_FALSE(decode_bytes({0x12, 0x01, 0x81, 0x00}, configure)) << "a number beyond its list";
}

TEST(Codec, CutAnywhereAMessageIsRefusedOrReadAsFarAsItGoes) {
  Examples{}.each([]<class Message>(Kind, const char* name, const Message& message) {
    const Bytes bytes = message_of(body_of(message, 0));
    for (std::size_t count = 0; count < bytes.size(); ++count) {
      const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(count));
      Message back;
      if (!decode_bytes(cut, back)) {
        ASSERT_TRUE(same(back, Message{})) << name << " cut to " << count;
        continue;
      }
      ASSERT_EQ(message_of(body_of(back, 0)), cut) << name << " cut to " << count;
    }
  });
}

TEST(Codec, WithAnyBitFlippedOrByteInsertedAMessageIsRefusedOrMakesSense) {
  Examples{}.each([]<class Message>(Kind, const char* name, const Message& message) {
    const Bytes bytes = message_of(body_of(message, 0));
    const auto check = [&](const Bytes& changed) {
      Message back;
      if (!decode_bytes(changed, back)) {
        ASSERT_TRUE(same(back, Message{})) << name;
        return;
      }
      Message again;
      ASSERT_TRUE(decode_bytes(message_of(body_of(back, 0)), again)) << name;
      ASSERT_TRUE(same(back, again)) << name;
    };
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
      Bytes flipped = bytes;
      flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ (1 << bit % 8));
      check(flipped);
    }
    for (std::size_t at = 0; at <= bytes.size(); ++at) {
      for (int byte = 0; byte < 256; ++byte) {
        Bytes longer = bytes;
        longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(at),
                      static_cast<std::uint8_t>(byte));
        check(longer);
      }
    }
  });
}

TEST(Codec, AnEnumValueOfALaterVersionIsRefused) {
  const auto refused = []<class Message>(Message, const Bytes& bytes) {
    Message back;
    return !decode_bytes(bytes, back) && same(back, Message{});
  };
  EXPECT_TRUE(refused(Configure{}, {0x12, 0x02, 0x01, 0x04}));
  EXPECT_TRUE(refused(Led{}, {0x08, 0x04, 0x10, 0x64}));
  EXPECT_TRUE(refused(Answer{}, {0x08, 0x01, 0x18, 0x07}));
  EXPECT_TRUE(refused(Fault{}, {0x08, 0x06, 0x10, 0x01}));
  // 2^32 + 1 does not come in as 1.
  EXPECT_TRUE(refused(Fault{}, {0x08, 0x81, 0x80, 0x80, 0x80, 0x10}));
}

TEST(Codec, AHelloOfALaterVersionStillTellsItsVersion) {
  Hello hello;
  ASSERT_TRUE(decode_bytes({0x08, 0x02, 0x10, 0x07, 0x38, 0x05}, hello));
  EXPECT_EQ(hello.protocol_major, 2);
  EXPECT_EQ(hello.protocol_minor, 7);
  EXPECT_EQ(hello.reset_cause, ResetCause::unknown);
}

TEST(Codec, FieldsOfALaterMinorVersionAreSkipped) {
  const Bytes later{
      0xF8, 0x01, 0x05,                      // field 31, varint
      0xF5, 0x01, 1,    2, 3, 4,             // field 30, fixed32
      0xEA, 0x01, 0x02, 9, 9,                // field 29, two bytes
      0xE1, 0x01, 1,    2, 3, 4, 5, 6, 7, 8  // field 28, fixed64
  };
  Examples{}.each([&]<class Message>(Kind, const char* name, const Message& message) {
    Bytes bytes = message_of(body_of(message, 0));
    bytes.insert(bytes.end(), later.begin(), later.end());
    Message back;
    EXPECT_TRUE(decode_bytes(bytes, back)) << name;
    EXPECT_TRUE(same(message, back)) << name;
  });
}

TEST(Codec, NumbersThatDoNotFitTheirFieldAreRefusedNotCut) {
  Led led;
  EXPECT_FALSE(decode_bytes({0x10, 0x80, 0x80, 0x04}, led));  // level_permille 65536
  Answer answer;
  EXPECT_FALSE(decode_bytes({0x10, 0x80, 0x02}, answer));  // request_sequence 256
}

TEST(Codec, MoreElementsThanThereIsRoomForAreRefused) {
  Configure configure;
  EXPECT_FALSE(decode_bytes({0x12, 0x05, 1, 1, 1, 1, 1}, configure));
  EXPECT_EQ(configure.cell_count, 0);
  SetId set_id;
  EXPECT_FALSE(decode_bytes({0x0A, 0x09, 1, 2, 3, 4, 5, 6, 7, 8, 9}, set_id));
  Hello hello;
  Bytes name{0x1A, 16};
  name.resize(2 + 16, 'x');
  EXPECT_FALSE(decode_bytes(name, hello));
}

TEST(Codec, CountsStringsAndIdsThatAreTooLongAreCut) {
  Configure configure{};
  configure.cell_count = 200;
  Configure configure_back;
  ASSERT_TRUE(decode_bytes(message_of(body_of(configure, 0)), configure_back));
  EXPECT_EQ(configure_back.cell_count, kMaxCells);

  Status status{};
  status.cell_count = 200;
  Status status_back;
  ASSERT_TRUE(decode_bytes(message_of(body_of(status, 0)), status_back));
  EXPECT_EQ(status_back.cell_count, kMaxCells);

  Hello hello{};
  std::fill(std::begin(hello.board), std::end(hello.board), 'b');
  hello.unique_id.count = 200;
  Hello hello_back;
  ASSERT_TRUE(decode_bytes(message_of(body_of(hello, 0)), hello_back));
  EXPECT_EQ(std::string(hello_back.board), std::string(sizeof hello.board - 1, 'b'));
  EXPECT_EQ(hello_back.unique_id.count, kIdBytes);
}

TEST(Codec, WhatDoesNotPrintInAStringReadsAsAQuestionMark) {
  Hello hello;
  ASSERT_TRUE(decode_bytes({0x1A, 8, 'a', 0x1B, '[', 'J', 0xFF, 0, 'b', 'c'}, hello));
  EXPECT_STREQ(hello.board, "a?[J?");
  EXPECT_EQ(hello.board[6], '\0') << "nothing after the first zero";
}

}  // namespace
}  // namespace tagwrench::link
