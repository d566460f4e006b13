#include <cmath>
#include <numbers>

#include "host/calibration/wrench/observations.h"

namespace tagwrench {
namespace {

/// At the frame in the middle of a push's window, which `rows` are. What it says beside the mean
/// has an error of its own: that of the frame, and how far platform and cell follow a hand's tremor
/// apart, which is what they scatter against each other within the window.
void predict_push(const Matrix6& K, const Eigen::MatrixXd& felt, double time,
                  const std::vector<Eigen::Index>& rows, const HeldOut& held, study::Trial& trial) {
  Eigen::VectorXd weight(static_cast<Eigen::Index>(rows.size()));
  Eigen::Index middle = rows.front();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double off = (trial.time[rows[i]] - time) / kPushWindow;
    weight[static_cast<Eigen::Index>(i)] = 0.5 + 0.5 * std::cos(std::numbers::pi * off);
    if (off == 0) middle = rows[i];
  }
  weight /= weight.sum();
  const Eigen::MatrixXd seen = trial.features(rows, Eigen::all) * K.transpose();
  const Eigen::MatrixXd apart = felt(rows, Eigen::all) - seen;
  const Eigen::RowVectorXd mean = weight.transpose() * apart;
  const Vector6 scatter = ((apart.rowwise() - mean).cwiseAbs2().transpose() * weight).cwiseMax(0.0);
  const Eigen::RowVectorXd seen_mean = weight.transpose() * seen;
  trial.predicted.row(middle) =
      held.predicted.transpose() + trial.features.row(middle) * K.transpose() - seen_mean;
  trial.predicted_sigma.row(middle) = (held.sigma.cwiseAbs2() + scatter).cwiseSqrt().transpose();
}

}  // namespace

void add_predictions(const WrenchPlan& plan, const WrenchFit& fit, WrenchData& data) {
  study::Trial& trial = data.trial;
  const Eigen::Index n = trial.time.size();
  trial.predicted.setConstant(n, 6, std::nan(""));
  trial.predicted_sigma.setConstant(n, 6, std::nan(""));
  Eigen::MatrixXd felt;
  if (plan.reference == ReferenceKind::load_cell) {
    felt = study::reference_at(trial.time, data.lag.value, trial.reference_time, trial.reference,
                               kMaxGap);
  }
  for (const HeldOut& held : fit.held_out) {
    const Observation& o = data.observations[held.observation];
    const StepKind kind = plan.steps[static_cast<std::size_t>(o.step)].kind;
    const bool hold = kind == StepKind::rest || kind == StepKind::mass;
    const bool push = kind == StepKind::push;
    const double reach = push ? kPushWindow : 0;
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (trial.step[i] == o.step && (hold || std::abs(trial.time[i] - o.time) <= reach))
        rows.push_back(i);
    }
    if (rows.empty()) continue;
    if (push) {
      predict_push(fit.model.K, felt, o.time, rows, held, trial);
      continue;
    }
    const Eigen::RowVectorXd mean = trial.features(rows, Eigen::all).colwise().mean();
    for (const Eigen::Index row : rows) {
      const Vector6 apart = (trial.features.row(row) - mean).transpose();
      trial.predicted.row(row) = (held.predicted + fit.model.K * apart).transpose();
      // Its own noise beside that of the hold's mean; of a single frame the fit has counted it.
      Vector6 variance = held.sigma.cwiseAbs2();
      if (hold) {
        const Vector6 own = trial.feature_sigma.row(row).transpose();
        variance += fit.model.K.cwiseAbs2() * own.cwiseAbs2();
      }
      trial.predicted_sigma.row(row) = variance.cwiseSqrt().transpose();
    }
  }
}

}  // namespace tagwrench
