// write_seeds DIR: one example of every message kind as first inputs of the fuzzers, in DIR/frames,
// DIR/messages, DIR/streams and DIR/board.
#include <filesystem>
#include <fstream>
#include <iostream>

#include "tests/unit/protocol/messages.h"

namespace {

using tagwrench::link::Bytes;

void write(const std::filesystem::path& path, const Bytes& bytes) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

void append(Bytes& stream, const Bytes& frame) {
  stream.insert(stream.end(), frame.begin(), frame.end());
}

}  // namespace

int main(int argc, char** argv) try {
  using namespace tagwrench::link;
  if (argc != 2) {
    std::cerr << "usage: write_seeds DIR\n";
    return 2;
  }
  const std::filesystem::path dir = argv[1];
  Bytes requests;
  Bytes reports;
  Bytes board{0, 0, 0, 1};
  std::uint8_t sequence = 0;
  Examples{}.each([&](Kind kind, const char* name, const auto& message) {
    const Bytes body = body_of(message, sequence++);
    Bytes kind_and_message{body[0]};
    kind_and_message.insert(kind_and_message.end(), body.begin() + kHeaderBytes, body.end());
    write(dir / "messages" / name, kind_and_message);
    write(dir / "frames" / name, frame_of(body));
    append(static_cast<std::uint8_t>(kind) < 0x80 ? requests : reports, frame_of(body));
    // board_app.cpp's steps: a good frame, some time, and a conversion of channel 0.
    board.insert(board.end(), {1, static_cast<std::uint8_t>(body.size() - kHeaderBytes)});
    append(board, body);
    board.insert(board.end(), {3, 1, 4, 0, 0, 1, 2, 3, 0, 1, 2, 100});
  });
  write(dir / "streams" / "requests", requests);
  write(dir / "streams" / "reports", reports);
  write(dir / "board" / "requests", board);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "write_seeds: " << error.what() << '\n';
  return 1;
}
