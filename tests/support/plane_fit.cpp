#include "tests/support/plane_fit.h"

#include <Eigen/Dense>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace tagwrench::test {
namespace {

constexpr int kUnknowns = 11;  // motion (3 + 3), paper, its fall along x and y, ink, blur
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;

struct Problem {
  const cv::Mat& picture;
  Eigen::Matrix3d camera;
  const cv::Mat& cells;
  double size;
  std::vector<cv::Point> pixels;
};

struct Guess {
  Eigen::Isometry3d pose;
  double paper, fall_x, fall_y, ink, blur;  // grey levels; blur as a share of the tag's size
};

Guess moved(const Guess& guess, const Unknowns& by, double depth) {
  Guess next = guess;
  const Eigen::Vector3d turn = by.segment<3>(3);
  next.pose.translation() += depth * by.head<3>();
  next.pose.linear() =
      Eigen::AngleAxisd(turn.norm(), turn.norm() > 0 ? turn.normalized().eval()
                                                     : Eigen::Vector3d::UnitX().eval()) *
      guess.pose.linear();
  next.paper += 100 * by[6];
  next.fall_x += 100 * by[7];
  next.fall_y += 100 * by[8];
  next.ink += 100 * by[9];
  next.blur += 0.01 * by[10];
  return next;
}

/// Share of ink of a row of cells' edges, blurred: 1 inside of [a, b], 0 outside.
double between(double x, double a, double b, double sigma) {
  return 0.5 * (std::erf((x - a) / (std::sqrt(2.0) * sigma)) -
                std::erf((x - b) / (std::sqrt(2.0) * sigma)));
}

Eigen::VectorXd residuals(const Problem& problem, const Guess& guess) {
  const int across = problem.cells.cols;
  Eigen::Matrix3d ray_from_plane;
  ray_from_plane << guess.pose.linear().leftCols<2>(), guess.pose.translation();
  const Eigen::Matrix3d plane_from_pixel = (problem.camera * ray_from_plane).inverse();
  Eigen::VectorXd result(static_cast<Eigen::Index>(problem.pixels.size()));
  std::vector<double> column(static_cast<std::size_t>(across));
  for (std::size_t i = 0; i < problem.pixels.size(); ++i) {
    const cv::Point& pixel = problem.pixels[i];
    const Eigen::Vector2d p =
        (plane_from_pixel * Eigen::Vector3d(pixel.x, pixel.y, 1)).hnormalized() / problem.size;
    for (int c = 0; c < across; ++c) {
      column[static_cast<std::size_t>(c)] =
          between(p.x(), c / double(across) - 0.5, (c + 1) / double(across) - 0.5, guess.blur);
    }
    double ink = 0;
    for (int r = 0; r < across; ++r) {
      double in_row = 0;
      for (int c = 0; c < across; ++c) {
        if (problem.cells.at<std::uint8_t>(r, c) == 0)
          in_row += column[static_cast<std::size_t>(c)];
      }
      if (in_row > 0)
        ink += in_row *
               between(p.y(), r / double(across) - 0.5, (r + 1) / double(across) - 0.5, guess.blur);
    }
    const double paper = guess.paper + guess.fall_x * p.x() + guess.fall_y * p.y();
    const double model = paper + ink * (guess.ink - paper);
    result[static_cast<Eigen::Index>(i)] = problem.picture.at<std::uint8_t>(pixel) - model;
  }
  return result;
}

/// Pixels on the black square and a narrow rim of paper, which even ragged scissors leave.
std::vector<cv::Point> pixels_on(const Problem& problem, const Eigen::Isometry3d& pose) {
  constexpr double kRim = 0.05;  // of the tag's size
  const double h = (0.5 + kRim) * problem.size;
  std::vector<cv::Point2f> outline;
  for (const auto& [x, y] : {std::pair{-h, -h}, {h, -h}, {h, h}, {-h, h}}) {
    const Eigen::Vector2d p = (problem.camera * (pose * Eigen::Vector3d(x, y, 0))).hnormalized();
    outline.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  std::vector<cv::Point> inside;
  const cv::Rect box = cv::boundingRect(outline) & cv::Rect({}, problem.picture.size());
  for (int y = box.y; y < box.br().y; ++y) {
    for (int x = box.x; x < box.br().x; ++x) {
      if (cv::pointPolygonTest(outline, cv::Point2f(float(x), float(y)), false) >= 0)
        inside.emplace_back(x, y);
    }
  }
  return inside;
}

}  // namespace

Eigen::Isometry3d fit_tag_plane(const cv::Mat& picture, const Eigen::Matrix3d& camera,
                                const cv::Mat& cells, double size,
                                const Eigen::Isometry3d& camera_T_tag) {
  constexpr int kIterations = 25;
  constexpr double kStep = 1e-5;
  Problem problem{picture, camera, cells, size, {}};
  problem.pixels = pixels_on(problem, camera_T_tag);
  const double depth = camera_T_tag.translation().z();
  Guess guess{camera_T_tag, 200, 0, 0, 40, 0.012};
  double damping = 1e-3;
  Eigen::VectorXd error = residuals(problem, guess);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::MatrixXd slopes(error.size(), kUnknowns);
    for (int k = 0; k < kUnknowns; ++k) {
      const Unknowns step = kStep * Unknowns::Unit(k);
      slopes.col(k) = (residuals(problem, moved(guess, step, depth)) -
                       residuals(problem, moved(guess, -step, depth))) /
                      (2 * kStep);
    }
    // Levenberg and Marquardt, with Huber's weights against hairs and specks of dust.
    const double limit = 3 * std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
    const Eigen::VectorXd weight = error.unaryExpr(
        [limit](double e) { return std::abs(e) < limit ? 1.0 : limit / std::abs(e); });
    Eigen::MatrixXd normal = slopes.transpose() * weight.asDiagonal() * slopes;
    const Unknowns gradient = slopes.transpose() * weight.cwiseProduct(error);
    normal.diagonal() *= 1 + damping;
    const Guess next = moved(guess, -normal.ldlt().solve(gradient), depth);
    const Eigen::VectorXd left = residuals(problem, next);
    const double gain = 1 - left.squaredNorm() / error.squaredNorm();
    if (gain >= 0) {
      guess = next;
      error = left;
      damping *= 0.1;
      if (gain < 1e-8) break;
    } else {
      damping *= 10;
    }
  }
  return guess.pose;
}

}  // namespace tagwrench::test
