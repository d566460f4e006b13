#include "protocol/frame.h"

#include <gtest/gtest.h>

#include <new>
#include <random>

#include "tests/unit/protocol/guarded_bytes.h"
#include "tests/unit/protocol/messages.h"

namespace tagwrench::link {
namespace {

/// All that a reader made of some bytes.
struct Heard {
  std::vector<Bytes> bodies;
  int damaged = 0;
};

Heard hear(FrameReader& reader, const Bytes& bytes) {
  Heard heard;
  for (const std::uint8_t byte : bytes) {
    switch (reader.take(byte)) {
      case Received::nothing: break;
      case Received::frame:
        heard.bodies.emplace_back(reader.body(), reader.body() + reader.body_bytes());
        break;
      case Received::damaged: ++heard.damaged; break;
    }
  }
  return heard;
}

std::vector<Bytes> example_bodies() {
  std::vector<Bytes> bodies;
  Examples{}.each([&](Kind, const char*, const auto& message) {
    bodies.push_back(body_of(message, static_cast<std::uint8_t>(bodies.size())));
  });
  return bodies;
}

const Bytes kNextBody{0x04, 0x77};

/// Reads `bytes`, which end with a delimiter, and an undamaged frame after them. That one must be
/// read; returns what was read before it.
Heard hear_before_next(const Bytes& bytes) {
  FrameReader reader;
  Heard heard = hear(reader, bytes);
  const Heard next = hear(reader, frame_of(kNextBody));
  EXPECT_EQ(next.bodies, std::vector<Bytes>{kNextBody}) << "not resynchronised";
  EXPECT_EQ(next.damaged, 0);
  EXPECT_EQ(reader.damaged_frames(), heard.damaged);
  return heard;
}

Bytes random_body(std::mt19937& random, std::size_t count) {
  Bytes body(count);
  const int zeros = static_cast<int>(random() % 4);
  for (std::uint8_t& byte : body) byte = random() % 4 < static_cast<unsigned>(zeros) ? 0 : random();
  return body;
}

Bytes and_crc(Bytes body) {
  const std::uint16_t crc = crc16(body.data(), static_cast<std::uint8_t>(body.size()));
  body.push_back(static_cast<std::uint8_t>(crc));
  body.push_back(static_cast<std::uint8_t>(crc >> 8));
  return body;
}

/// COBS and delimiter by the book, without the writer's checks.
Bytes stuffed(const Bytes& bytes) {
  Bytes frame(1, 1);
  std::size_t code_at = 0;
  for (const std::uint8_t byte : bytes) {
    if (byte == 0) {
      code_at = frame.size();
      frame.push_back(1);
    } else {
      frame.push_back(byte);
      ++frame[code_at];
    }
  }
  frame.push_back(0);
  return frame;
}

TEST(Crc, OfTheCheckStringIsTheCataloguedValue) {
  const char check[] = "123456789";
  EXPECT_EQ(crc16(reinterpret_cast<const std::uint8_t*>(check), 9), 0x29B1);
  EXPECT_EQ(crc16(nullptr, 0), 0xFFFF);
}

TEST(Crc, EqualsTheDivisionByItsPolynomial) {
  std::mt19937 random{1};
  for (int n = 0; n < 1000; ++n) {
    const Bytes bytes = random_body(random, random() % 85);
    std::uint16_t expected = 0xFFFF;
    for (const std::uint8_t byte : bytes) {
      expected = static_cast<std::uint16_t>(expected ^ (byte << 8));
      for (int bit = 0; bit < 8; ++bit) {
        const bool carry = (expected & 0x8000) != 0;
        expected = static_cast<std::uint16_t>((expected << 1) ^ (carry ? 0x1021 : 0));
      }
    }
    ASSERT_EQ(crc16(bytes.data(), static_cast<std::uint8_t>(bytes.size())), expected);
  }
}

TEST(Frame, OfEveryLengthIsReadBackAndHasNoZeroBeforeItsEnd) {
  std::mt19937 random{2};
  FrameReader reader;
  for (int n = 0; n < 5000; ++n) {
    const Bytes body =
        random_body(random, kHeaderBytes + random() % (kMaxBodyBytes - kHeaderBytes + 1u));
    const Bytes frame = frame_of(body);
    ASSERT_EQ(frame.size(), 1 + body.size() + kCrcBytes + 1);
    ASSERT_EQ(std::ranges::find(frame, 0), frame.end() - 1);
    const Heard heard = hear(reader, frame);
    ASSERT_EQ(heard.bodies, std::vector<Bytes>{body});
  }
  EXPECT_EQ(reader.damaged_frames(), 0);
}

TEST(Frame, IsNotWrittenOfABodyWithoutHeaderOrTooLong) {
  const Bytes body(kMaxBodyBytes + 1, 1);
  Bytes frame(kMaxFrameBytes, 0xEE);
  for (const int count : {0, 1, kMaxBodyBytes + 1, 255}) {
    EXPECT_EQ(write_frame(body.data(), static_cast<std::uint8_t>(count), frame.data()), 0);
  }
  EXPECT_EQ(frame, Bytes(kMaxFrameBytes, 0xEE));
}

TEST(Frame, TheLongestOneFillsItsRoomAndNoMore) {
  for (const int byte : {0, 1, 255}) {
    GuardedBytes body{Bytes(kMaxBodyBytes, static_cast<std::uint8_t>(byte))};
    GuardedBytes frame{Bytes(kMaxFrameBytes)};
    EXPECT_EQ(write_frame(body.data(), kMaxBodyBytes, frame.data()), kMaxFrameBytes);
  }
}

TEST(Frame, CanBeWrittenInPlaceOfABodyOneByteFurtherOn) {
  std::mt19937 random{6};
  for (int n = 0; n < 1000; ++n) {
    const Bytes body =
        random_body(random, kHeaderBytes + random() % (kMaxBodyBytes - kHeaderBytes + 1u));
    Bytes frame(kMaxFrameBytes);
    std::ranges::copy(body, frame.begin() + 1);
    frame.resize(
        write_frame(frame.data() + 1, static_cast<std::uint8_t>(body.size()), frame.data()));
    ASSERT_EQ(frame, frame_of(body));
  }
}

TEST(FrameReader, CutFramesOfEveryKindAreDroppedAndCounted) {
  for (const Bytes& body : example_bodies()) {
    const Bytes frame = frame_of(body);
    for (std::size_t from = 0; from < frame.size(); ++from) {
      for (std::size_t to = from + 1; to <= frame.size(); ++to) {
        Bytes cut(frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(from));
        cut.insert(cut.end(), frame.begin() + static_cast<std::ptrdiff_t>(to), frame.end());
        if (cut.empty() || cut.back() != 0) cut.push_back(0);  // the cut hit the delimiter
        const Heard heard = hear_before_next(cut);
        if (cut == frame) continue;  // that was all that it hit
        ASSERT_TRUE(heard.bodies.empty())
            << "bytes " << from << " to " << to << " of kind " << int{body[0]} << " cut";
        ASSERT_EQ(heard.damaged, cut.size() > 1 ? 1 : 0);
      }
    }
  }
}

TEST(FrameReader, FlippedBitsInFramesOfEveryKindAreDroppedAndCounted) {
  for (const Bytes& body : example_bodies()) {
    const Bytes frame = frame_of(body);
    for (std::size_t bit = 0; bit < 8 * (frame.size() - 1); ++bit) {
      Bytes flipped = frame;
      flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ (1 << bit % 8));
      const Heard heard = hear_before_next(flipped);
      ASSERT_TRUE(heard.bodies.empty()) << "bit " << bit << " of kind " << int{body[0]};
      ASSERT_GE(heard.damaged, 1);
      ASSERT_LE(heard.damaged, 2) << "a byte that became a delimiter makes two of one";
    }
  }
}

TEST(FrameReader, AFlippedDelimiterCostsTheTwoFramesThatItParted) {
  const std::vector<Bytes> bodies = example_bodies();
  for (int bit = 0; bit < 8; ++bit) {
    Bytes stream = frame_of(bodies[0]);
    stream.back() = static_cast<std::uint8_t>(1 << bit);
    const Bytes second = frame_of(bodies[1]);
    stream.insert(stream.end(), second.begin(), second.end());
    const Heard heard = hear_before_next(stream);
    EXPECT_TRUE(heard.bodies.empty());
    EXPECT_EQ(heard.damaged, 1);
  }
}

TEST(FrameReader, BytesInsertedAnywhereInFramesOfEveryKindAreDroppedAndCounted) {
  for (const Bytes& body : example_bodies()) {
    const Bytes frame = frame_of(body);
    for (std::size_t at = 0; at < frame.size(); ++at) {
      for (int byte = 0; byte < 256; ++byte) {
        Bytes longer = frame;
        longer.insert(longer.begin() + static_cast<std::ptrdiff_t>(at),
                      static_cast<std::uint8_t>(byte));
        const Heard heard = hear_before_next(longer);
        if (byte == 0 && (at == 0 || at + 1 == frame.size())) {
          ASSERT_EQ(heard.bodies, std::vector<Bytes>{body}) << "a second delimiter is no error";
          ASSERT_EQ(heard.damaged, 0);
        } else {
          ASSERT_TRUE(heard.bodies.empty()) << byte << " at " << at << " of kind " << int{body[0]};
          ASSERT_EQ(heard.damaged, byte == 0 ? 2 : 1);
        }
      }
    }
  }
}

TEST(FrameReader, ResynchronisesWithinOneFrameWhereverItStartsToListen) {
  const std::vector<Bytes> bodies = example_bodies();
  for (const Bytes& body : bodies) {
    const Bytes frame = frame_of(body);
    for (std::size_t from = 1; from < frame.size(); ++from) {
      const Heard heard =
          hear_before_next(Bytes(frame.begin() + static_cast<std::ptrdiff_t>(from), frame.end()));
      EXPECT_TRUE(heard.bodies.empty());
    }
  }
}

TEST(FrameReader, AWrongCrcIsCountedAndDropped) {
  for (const Bytes& body : example_bodies()) {
    const Bytes with_crc = and_crc(body);
    for (std::size_t at = 0; at < with_crc.size(); ++at) {
      Bytes wrong = with_crc;
      wrong[at] = static_cast<std::uint8_t>(wrong[at] + 1);
      const Heard heard = hear_before_next(stuffed(wrong));
      ASSERT_TRUE(heard.bodies.empty());
      ASSERT_EQ(heard.damaged, 1);
    }
  }
}

TEST(FrameReader, AnOverlongFrameIsOneDamagedFrameAndWritesNowhereElse) {
  // At the end of memory, and with its state after its buffer: a byte beyond is not missed.
  GuardedBytes room{Bytes(sizeof(FrameReader))};
  FrameReader* reader = new (room.data()) FrameReader;
  static_assert(alignof(FrameReader) <= 2 && sizeof(FrameReader) % alignof(FrameReader) == 0);
  for (const int byte : {1, 2, 85, 86, 254, 255}) {
    for (const int count : {85, 86, 87, 254, 255, 256, 257, 70000}) {
      const std::uint16_t before = reader->damaged_frames();
      for (int i = 0; i < count; ++i) {
        ASSERT_EQ(reader->take(static_cast<std::uint8_t>(byte)), Received::nothing);
      }
      ASSERT_EQ(reader->take(0), Received::damaged);
      ASSERT_EQ(reader->damaged_frames(), before + 1);
      ASSERT_EQ(hear(*reader, frame_of(kNextBody)).bodies, std::vector<Bytes>{kNextBody});
    }
  }
  reader->~FrameReader();
}

TEST(FrameReader, AWrongLengthIsDamagedAlthoughTheCrcIsRight) {
  const auto damaged = [](const Bytes& bytes) {
    const Heard heard = hear_before_next(stuffed(bytes));
    return heard.bodies.empty() && heard.damaged == 1;
  };
  EXPECT_TRUE(damaged(and_crc({})));
  EXPECT_TRUE(damaged(and_crc({0x04})));
  EXPECT_FALSE(damaged(and_crc({0x04, 0x00})));
  const Bytes longest(kMaxBodyBytes, 0x11);
  EXPECT_FALSE(damaged(and_crc(longest)));
  EXPECT_TRUE(damaged(and_crc(Bytes(kMaxBodyBytes + 1, 0x11))));
  Bytes and_more = and_crc(longest);
  and_more.push_back(0x22);
  EXPECT_TRUE(damaged(and_more));
}

TEST(FrameReader, DelimitersInARowAreNoError) {
  FrameReader reader;
  EXPECT_EQ(hear(reader, Bytes(100, 0)).damaged, 0);
  EXPECT_EQ(reader.damaged_frames(), 0);
}

TEST(FrameReader, ItsCounterWraps) {
  FrameReader reader;
  for (int i = 0; i < 65537; ++i) hear(reader, {1, 0});
  EXPECT_EQ(reader.damaged_frames(), 1);
}

TEST(FrameReader, UnderNoiseOfOneBitInAThousandWhatIsReadIsWhatWasSent) {
  const std::vector<Bytes> bodies = example_bodies();
  std::mt19937 random{3};
  std::geometric_distribution<int> quiet_bits{0.001};
  FrameReader reader;
  int until_flip = quiet_bits(random);
  constexpr int kFrames = 20000;
  int read = 0;
  for (int n = 0; n < kFrames; ++n) {
    Bytes frame = frame_of(bodies[random() % bodies.size()]);
    for (std::uint8_t& byte : frame) {
      for (int bit = 0; bit < 8; ++bit) {
        if (until_flip-- > 0) continue;
        byte = static_cast<std::uint8_t>(byte ^ (1 << bit));
        until_flip = quiet_bits(random);
      }
    }
    for (const Bytes& body : hear(reader, frame).bodies) {
      ++read;
      ASSERT_NE(std::ranges::find(bodies, body), bodies.end()) << "read what nobody sent";
    }
  }
  // A frame of 24 bytes on average stays whole with a probability of 0.999^192 = 0.82, and loses
  // its neighbour when its delimiter is hit.
  EXPECT_GT(read, kFrames * 0.75);
  EXPECT_LT(read, kFrames * 0.90);
  EXPECT_GT(reader.damaged_frames(), kFrames * 0.10);
}

}  // namespace
}  // namespace tagwrench::link
