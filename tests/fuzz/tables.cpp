// Any text as each of the tables that people bring: a trial's data, columns of others, the times of
// frames, an image for the board.
#include <algorithm>
#include <array>

#include "host/board/hex_image.h"
#include "host/calibration/analysis/trial_csv.h"
#include "host/source/replay.h"
#include "tests/fuzz/memory_file.h"

namespace {

using namespace tagwrench;

void trial(const std::string& text) {
  const study::Trial read = study::read_trial(fuzz::MemoryFile(text).path());
  expect(study::shapes_fit(read), "columns are of one length");
  expect(read.features.allFinite() && read.reference.allFinite(), "numbers are finite");
  const study::Trial again = study::read_trial(fuzz::MemoryFile(study::trial_to_csv(read)).path());
  expect(again.features.rows() == read.features.rows(), "a trial reads back");
}

/// The first line is what is said of the columns, the others are the table.
void columns_of_others(const std::string& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const fuzz::MemoryFile file(text.substr(std::min(end + 1, text.size())));
  study::CsvMapping mapping;
  mapping.readings = file.path();
  mapping.features.push_back(
      study::parse_feature_columns(text.substr(0, end / 2), "--displacement"));
  mapping.loads.push_back(
      study::parse_load_columns(text.substr(end / 2, end - end / 2), "--reference-columns"));
  const study::MappedTrial read = study::read_mapped(mapping);
  expect(study::shapes_fit(read.trial), "columns are of one length");
  expect(read.trial.features.allFinite(), "numbers are finite");
}

void frame_times(const std::string& text) {
  const std::array<std::string, 3> files{"000000.png", "000001.png", "b.jpg"};
  const std::vector<Duration> times = parse_frame_times(text, "frames.csv", files);
  expect(times.size() == files.size(), "each frame has a time");
  expect(std::ranges::is_sorted(times), "times grow");
}

void hex_image(const std::string& text) {
  if (is_whole_hex_image(text)) expect(text.find(':') != std::string::npos, "an image has records");
}

constexpr void (*kReaders[])(const std::string& text) = {trial, columns_of_others, frame_times,
                                                         hex_image};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t count) {
  const fuzz::Choice choice(bytes, count);
  try {
    kReaders[choice.kind % std::size(kReaders)](choice.text);
  } catch (const ConfigError& e) {
    fuzz::check_refusal(e);
  }
  return 0;
}
