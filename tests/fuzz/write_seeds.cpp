// write_seeds DIR PROJECT: one example of every message kind as first inputs of the fuzzers, in
// DIR/frames, DIR/messages, DIR/streams and DIR/board; recordings that are as they should be, in
// DIR/recordings; what pages send, in DIR/web; and files of every kind (file_seeds.h).
#include <filesystem>
#include <fstream>
#include <iostream>

#include "tests/fuzz/file_seeds.h"
#include "tests/fuzz/recording_rows.h"
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

using namespace tagwrench::fuzz;

/// A frame with its track and sample.
void add_frame(RowWriter& rows, Word fourcc) {
  rows.row(Table::frames).next().same().same().same().small(0).words(fourcc).small(8);
  for (int region = 0; region < 2; ++region) rows.small(0).small(0).small(8).small(6);
  rows.blob(Bytes(48, 40));
  rows.row(Table::tracks).same().words(Word::ok).small(0);
  for (int i = 0; i < 6; ++i) rows.real(1e-3 * i);
  rows.reals(21, 1e-6).real(0.2).real(0.1).real(1).small(2).reals(18, 5);
  rows.row(Table::samples).same().same().same().same().same().small(0).words(Word::ok);
  for (int i = 0; i < 36; ++i) rows.real(1e-3 * i);
  rows.small(1).small(0);
}

/// A recording with something in every table: three frames, one that is missing, readings, a step
/// that was withdrawn and done again.
RowWriter recording() {
  RowWriter rows;
  for (const Word fourcc : {Word::grey, Word::grey, Word::crop}) add_frame(rows, fourcc);
  for (const int axes : {1, 6}) {
    rows.row(Table::reference).next().next().small(100).small(0).small(axes).small(0).small(0);
    for (int i = 0; i < 18; ++i) rows.real(i);
  }
  for (const Word kind : {Word::missing, Word::disconnected, Word::reconnected, Word::note})
    rows.row(Table::events).next().next().words(kind).small(-1).small(0).words(Word::note);
  for (const int value : {1, 0, -1, 2})
    rows.row(Table::events).next().next().words(Word::mark).small(0).small(value).null();
  rows.row(Table::files).words(Word::appearance).words(Word::note).blob(Bytes(20, 1));
  return rows;
}

/// Numbers that no recording has; in the order of a frame's rows: frame, track, sample.
RowWriter impossible() {
  constexpr int kFrame = 2;
  constexpr int kTrack = 1;
  constexpr int kSample = 0;
  constexpr std::uint8_t kMin = 0;  // of kEdges
  constexpr std::uint8_t kMax = 1;
  RowWriter rows = recording();
  add_frame(rows, Word::grey);
  rows.change(kSample, 3).edge(kMin).change(kSample, 4).edge(kMax);  // a latency
  add_frame(rows, Word::grey);
  rows.change(kTrack, 14).reals(9 * 20, 5).change(kTrack, 9).reals(200, 1);  // corners, covariance
  add_frame(rows, Word::crop);
  rows.change(kFrame, 15).blob(Bytes(7, 1));  // fewer bytes than pixels
  return rows;
}

/// Headers and a request, each on its line, as web_messages.cpp takes them.
void write_web(const std::filesystem::path& dir) {
  const auto text = [&](const char* name, std::string_view lines) {
    write(dir / name, Bytes(lines.begin(), lines.end()));
  };
  text("request", R"({"id":17,"ask":"try","name":"cad","text":"a: [1, {}]\n"})");
  text("headers",
       "/sensor/assets/%61.js?x\nlocalhost:8137\nhttp://localhost:8137\n"
       "tagwrench.v1, tagwrench.token.MDEyMzQ1Njc4OWFiY2RlZg\nBearer 0123456789abcdef");
  text("foreign", "/..%2f%2e%2e/x\n[::1]:80\nhttp://evil.example\nchat\nBasic x");
}

}  // namespace

int main(int argc, char** argv) try {
  using namespace tagwrench::link;
  if (argc != 3) {
    std::cerr << "usage: write_seeds DIR PROJECT\n";
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
  write(dir / "recordings" / "whole", recording().bytes());
  write(dir / "recordings" / "impossible", impossible().bytes());
  write(dir / "recordings" / "damaged",
        recording().change(6, 1).null().damage(100, 0).damage(3000, 0xff).bytes());
  write_web(dir / "web");
  tagwrench::fuzz::write_file_seeds(dir, argv[2]);
  return 0;
} catch (const std::exception& error) {
  std::cerr << "write_seeds: " << error.what() << '\n';
  return 1;
}
