#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <thread>

#include "host/recording/writer.h"

namespace tagwrench::record {
namespace {

TEST(ByteRing, WhatGoesInComesOutInOrderWhateverItsSize) {
  constexpr int kRecords = 20'000;
  ByteRing ring(16 << 10);
  std::thread reader([&ring] {
    std::minstd_rand random(1);
    for (int i = 0; i < kRecords; ++i) {
      std::span<std::byte> record;
      while ((record = ring.front()).empty()) std::this_thread::yield();
      ASSERT_EQ(record.size(), 4 + random() % 3000) << i;
      int number = 0;
      std::memcpy(&number, record.data(), sizeof number);
      ASSERT_EQ(number, i);
      ASSERT_EQ(static_cast<int>(record.back()), record.size() > 4 ? i % 251 : number >> 24);
      ring.pop();
    }
  });
  std::minstd_rand random(1);
  for (int i = 0; i < kRecords; ++i) {
    const std::size_t bytes = 4 + random() % 3000;
    std::byte* room = nullptr;
    while ((room = ring.reserve(bytes)) == nullptr) ring.wait_for_room();
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(room) % ByteRing::kAlignment, 0U);
    std::memset(room, i % 251, bytes);
    std::memcpy(room, &i, sizeof i);
    ring.publish();
  }
  reader.join();
}

TEST(ByteRing, AFullRingRefusesAndKeepsWhatItSpares) {
  ByteRing ring(4096);
  int taken = 0;
  for (; ring.reserve(200, 1024) != nullptr; ++taken) ring.publish();
  EXPECT_GT(taken, 5);
  EXPECT_EQ(ring.reserve(200, 1024), nullptr);
  EXPECT_NE(ring.reserve(200), nullptr) << "what was spared is there for others";
  ring.publish();
  while (!ring.front().empty()) ring.pop();
  EXPECT_NE(ring.reserve(200, 1024), nullptr);
  EXPECT_EQ(ring.reserve(5000), nullptr);
  EXPECT_FALSE(ring.could_hold(5000));
}

TEST(ByteRing, NothingIsThereBeforeItIsPublished) {
  ByteRing ring(4096);
  ASSERT_NE(ring.reserve(100), nullptr);
  EXPECT_TRUE(ring.front().empty());
  ring.publish();
  EXPECT_EQ(ring.front().size(), 100U);
}

}  // namespace
}  // namespace tagwrench::record
