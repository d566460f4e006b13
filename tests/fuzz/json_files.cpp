// Any text as each of the JSON files that the program writes. It is refused in a line, or what was
// read holds.
#include <cmath>

#include "host/board/cell_calibration.h"
#include "host/calibration/wrench/plan.h"
#include "host/commands/calibrate_wrench/result.h"
#include "host/sensor/calibration_file.h"
#include "host/wrench/estimate.h"
#include "tests/fuzz/memory_file.h"

namespace {

using namespace tagwrench;
using link::CellCalibration, link::CellCalibrations, link::load_cells;

void calibration(const std::string& text) {
  const Calibration read = read_calibration(fuzz::MemoryFile(text).path());
  expect(read.model.K.allFinite() && read.model.range.allFinite(), "a model is finite");
  const Calibration again = read_calibration(fuzz::MemoryFile(calibration_text(read)).path());
  expect((again.model.K - read.model.K).isZero(1e-6 * read.model.K.norm() + 1e-300),
         "a calibration reads back");
  expect(WrenchEstimator(read.model).tool().allFinite(), "it can be used");
}

void cells(const std::string& text) {
  const CellCalibrations read = load_cells(fuzz::MemoryFile(text).path(), "", "calibrate them");
  for (const CellCalibration& cell : read)
    expect(std::isfinite(cell.newtons_per_count) || !cell.calibrated, "a cell's scale is finite");
}

void progress(const std::string& text) {
  static const WrenchPlan plan = parse_plan(plan_text("paper"), "paper");
  const Progress read = load_progress(fuzz::MemoryFile(text).path(), {"a", "b"}, plan);
  for (const StepRecord& record : read.records)
    expect(record.step >= 0 && record.step < static_cast<int>(plan.steps.size()),
           "a step is one of the plan's");
}

constexpr void (*kReaders[])(const std::string& text) = {calibration, cells, progress};

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
