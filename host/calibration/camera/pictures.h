// What became of every picture that a camera calibration was shown.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace tagwrench {

enum class Fate : std::uint8_t {
  view,         ///< of the board, not like any other
  used,         ///< in the fit
  contradicts,  ///< a view that the other views contradict
  spare,        ///< a view, but there are enough that differ more
  alike,        ///< as another picture
  moving,       ///< live only
  no_board,
  other_board,
  part,
  dark,
  saturated,
  blurred,
  other_size,
  unreadable,
};

struct Picture {
  std::string name;  ///< of the file; empty of a frame of a camera, which is only counted
  Fate fate = Fate::no_board;
  std::string detail;  ///< of this one, for people: "as left1.png"
};

class Pictures {
 public:
  void add(Picture picture);
  /// Later more is known of one.
  void became(const std::string& name, Fate fate, std::string detail);

  int count(Fate fate) const;
  int all() const;
  bool empty() const { return all() == 0; }

  /// For people, a line for each fate: the names, and what there is to say of each. Of more than a
  /// few neighbours in a row only the first and the last are named.
  std::vector<std::string> lines() const;
  /// "13 of 18 pictures are overexposed: less light or a shorter exposure", of the reason for which
  /// most were lost; empty where the views are more than those.
  std::string main_loss() const;

 private:
  std::vector<Picture> named_;
  std::map<Fate, int> counted_;
};

}  // namespace tagwrench
