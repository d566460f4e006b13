// How far the edges of printed tags lie off the pattern.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "host/tracker/edges.h"

namespace tagwrench {

struct PrintScatter {
  double robust = 0;     ///< standard deviation of one edge point about pattern and spread, m
  double effective = 0;  ///< what a point counts as: neighbours along an edge err alike, m
};

/// `shift` of every point of all tags in order (tag t has first[t] .. first[t+1]) and `spread` of
/// every tag, both toward white, m.
PrintScatter print_scatter(const std::vector<EdgeTag>& printed,
                           const std::vector<Eigen::Index>& first, const Eigen::VectorXd& shift,
                           const std::vector<double>& spread);

}  // namespace tagwrench
