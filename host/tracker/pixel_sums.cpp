#include <algorithm>

#include "host/tracker/photometric.h"

// Vectors of a length known only at run time (SVE, RVV) cannot be kept in arrays, as sums are here.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "host/tracker/pixel_sums.cpp"
#include <hwy/foreach_target.h>
// foreach_target.h comes first.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace tagwrench {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Float = HWY_CAPPED(float, kRun);
using Int = hn::Rebind<std::int32_t, Float>;
using V = hn::Vec<Float>;

/// A patch is worked off in blocks that stay in the first-level cache.
constexpr std::size_t kBlock = 256;

struct Block {
  HWY_ALIGN std::array<std::int32_t, kBlock> at;  ///< of the image pixel
  HWY_ALIGN std::array<float, kBlock> dx, dy;     ///< from the template's pixel, px
  HWY_ALIGN std::array<float, kBlock> x, y, z;    ///< from the platform's origin, camera axes, m
  HWY_ALIGN std::array<float, kBlock> inverse;    ///< 1 / depth, 1/m
};

struct Lens {
  bool distorted;
  float fx, fy, cx, cy, k1, k2, p1, p2, k3;
};

/// Projects template pixels [first, first + count) and finds the nearest image pixels, or looks
/// where those that were found before lie now.
HWY_NOINLINE void find_pixels(const PixelTemplate& t, const Lens& lens, const PixelWindow& image,
                              const PatchView& view, bool keep, std::size_t first,
                              std::size_t count, PixelPairs& pairs, Block& block) {
  const Float d;
  const Int di;
  const auto set = [&](float value) { return hn::Set(d, value); };
  const auto& r = view.camera_R_platform;
  const auto& p = view.camera_t_platform;
  const auto& a = view.template_per_image;
  const V left = set(static_cast<float>(image.left));
  const V top = set(static_cast<float>(image.top));
  const V last_column = set(static_cast<float>(image.right - 1));
  const V last_row = set(static_cast<float>(image.bottom - 1));
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const V px = hn::LoadU(d, t.x.data() + first + i);
    const V py = hn::LoadU(d, t.y.data() + first + i);
    const V pz = hn::LoadU(d, t.z.data() + first + i);
    const auto row = [&](std::size_t k) {
      return hn::MulAdd(px, set(r[3 * k]),
                        hn::MulAdd(py, set(r[3 * k + 1]), hn::Mul(pz, set(r[3 * k + 2]))));
    };
    const V lever_x = row(0);
    const V lever_y = row(1);
    const V lever_z = row(2);
    const V depth = hn::Add(lever_z, set(p[2]));
    const V inverse = hn::Div(set(1.0F), depth);
    V x = hn::Mul(hn::Add(lever_x, set(p[0])), inverse);
    V y = hn::Mul(hn::Add(lever_y, set(p[1])), inverse);
    hn::Store(lever_x, d, block.x.data() + i);
    hn::Store(lever_y, d, block.y.data() + i);
    hn::Store(lever_z, d, block.z.data() + i);
    hn::Store(inverse, d, block.inverse.data() + i);
    if (lens.distorted) {
      const V xx = hn::Mul(x, x);
      const V yy = hn::Mul(y, y);
      const V xy2 = hn::Mul(set(2.0F), hn::Mul(x, y));
      const V r2 = hn::Add(xx, yy);
      const V radial = hn::MulAdd(
          r2, hn::MulAdd(r2, hn::MulAdd(r2, set(lens.k3), set(lens.k2)), set(lens.k1)), set(1.0F));
      const V two = set(2.0F);
      const V tx = hn::MulAdd(set(lens.p1), xy2, hn::Mul(set(lens.p2), hn::MulAdd(two, xx, r2)));
      const V ty = hn::MulAdd(set(lens.p2), xy2, hn::Mul(set(lens.p1), hn::MulAdd(two, yy, r2)));
      x = hn::MulAdd(x, radial, tx);
      y = hn::MulAdd(y, radial, ty);
    }
    const V u = hn::MulAdd(x, set(lens.fx), set(lens.cx));
    const V v = hn::MulAdd(y, set(lens.fy), set(lens.cy));
    float* const columns = pairs.column.data() + first + i;
    float* const rows = pairs.row.data() + first + i;
    if (!keep) {
      const V column = hn::Round(u);
      const V line = hn::Round(v);
      // False for NaN as well.
      const auto inside = hn::And(
          hn::And(hn::Ge(column, left), hn::Le(column, last_column)),
          hn::And(hn::And(hn::Ge(line, top), hn::Le(line, last_row)), hn::Gt(depth, set(1e-4F))));
      const V safe_column = hn::IfThenElse(inside, column, left);
      const V safe_line = hn::IfThenElse(inside, line, top);
      hn::StoreU(safe_column, d, columns);
      hn::StoreU(safe_line, d, rows);
      hn::StoreU(hn::IfThenElseZero(inside, set(1.0F)), d, pairs.valid.data() + first + i);
      hn::Store(hn::Add(hn::Mul(hn::ConvertTo(di, safe_line), hn::Set(di, image.stride)),
                        hn::ConvertTo(di, safe_column)),
                di, block.at.data() + i);
    }
    // Where the pair is void, whatever is far away counts for nothing.
    const V reach = set(1.0F);
    const V du = hn::Max(hn::Neg(reach), hn::Min(reach, hn::Sub(hn::LoadU(d, columns), u)));
    const V dv = hn::Max(hn::Neg(reach), hn::Min(reach, hn::Sub(hn::LoadU(d, rows), v)));
    hn::Store(hn::MulAdd(du, set(a[0]), hn::Mul(dv, set(a[1]))), d, block.dx.data() + i);
    hn::Store(hn::MulAdd(du, set(a[2]), hn::Mul(dv, set(a[3]))), d, block.dy.data() + i);
  }
}

HWY_NOINLINE void compare(const PixelTemplate& t, const Lens& lens, const PatchView& view,
                          float inverse_cut, std::size_t first, std::size_t count,
                          const PixelPairs& pairs, const Block& block, NormalEquations& sums) {
  const Float d;
  const auto set = [&](float value) { return hn::Set(d, value); };
  const V zero = hn::Zero(d);
  const V one = set(1.0F);
  const V cut = set(inverse_cut);
  const V saturated = set(253.5F);
  V rhs[kPatchParameters];
  for (V& sum : rhs) sum = zero;
  V squares = zero;
  V weights = zero;
  V inside = zero;
  for (std::size_t i = 0; i < count; i += hn::Lanes(d)) {
    const std::size_t at = first + i;
    const auto load = [&](const PixelArray& array) { return hn::LoadU(d, array.data() + at); };
    const auto polynomial = [&](std::size_t k) { return load(t.level[k]); };
    const V dx = hn::Load(d, block.dx.data() + i);
    const V dy = hn::Load(d, block.dy.data() + i);
    const V level = load(pairs.level);
    const V weight = load(t.weight);
    const V depth = load(t.depth);
    const V across = load(t.across);
    const V down = load(t.down);
    const V middle = polynomial(0);

    // Horner in dx, with coefficients that are polynomials in dy.
    const V linear = hn::MulAdd(dy, hn::MulAdd(dy, polynomial(8), polynomial(4)), polynomial(1));
    const V square = hn::MulAdd(dy, polynomial(7), polynomial(3));
    const V without_dx =
        hn::MulAdd(dy, hn::MulAdd(dy, polynomial(9), polynomial(5)), polynomial(2));
    V expected = hn::MulAdd(dx, hn::MulAdd(dx, hn::MulAdd(dx, polynomial(6), square), linear),
                            hn::MulAdd(dy, without_dx, middle));
    const V laplacian = hn::Mul(
        set(2.0F),
        hn::Add(hn::Add(polynomial(3), polynomial(5)),
                hn::MulAdd(dx, hn::MulAdd(set(3.0F), polynomial(6), polynomial(8)),
                           hn::Mul(dy, hn::MulAdd(set(3.0F), polynomial(9), polynomial(7))))));
    const V blur = hn::MulAdd(set(view.blur[1]), depth, set(view.blur[0]));
    const V more = hn::MulAdd(hn::Mul(set(0.5F), blur), load(t.bilaplacian), laplacian);
    expected = hn::MulAdd(blur, more, expected);
    const V gain =
        hn::MulAdd(across, set(view.gain[1]),
                   hn::MulAdd(down, hn::MulAdd(down, set(view.gain[3]), set(view.gain[2])),
                              set(view.gain[0])));
    const V residual =
        hn::Mul(weight, hn::Sub(hn::MulAdd(gain, level, set(view.offset)), expected));

    const auto usable = hn::And(hn::Lt(level, saturated), hn::Gt(weight, zero));
    const V valid = hn::IfThenElseZero(usable, load(pairs.valid));
    const V q = hn::Mul(residual, cut);
    const V biweight = hn::Max(zero, hn::NegMulAdd(q, q, one));
    const V w = hn::Mul(valid, hn::Mul(biweight, biweight));
    const V wr = hn::Mul(w, residual);

    // d residual / d motion: gradient in the template, carried to the image, carried to the point.
    const V two = set(2.0F);
    const V gradient_x =
        hn::MulAdd(hn::Mul(two, dx), polynomial(3), hn::MulAdd(dy, polynomial(4), polynomial(1)));
    const V gradient_y =
        hn::MulAdd(hn::Mul(two, dy), polynomial(5), hn::MulAdd(dx, polynomial(4), polynomial(2)));
    const auto& a = view.template_per_image;
    const V inverse = hn::Load(d, block.inverse.data() + i);
    const V x = hn::Load(d, block.x.data() + i);
    const V y = hn::Load(d, block.y.data() + i);
    const V z = hn::Load(d, block.z.data() + i);
    const V wrw = hn::Mul(wr, weight);
    const V wri = hn::Mul(wrw, inverse);
    const V pull_x = hn::Mul(hn::Mul(wri, set(lens.fx)),
                             hn::MulAdd(gradient_x, set(a[0]), hn::Mul(gradient_y, set(a[2]))));
    const V pull_y = hn::Mul(hn::Mul(wri, set(lens.fy)),
                             hn::MulAdd(gradient_x, set(a[1]), hn::Mul(gradient_y, set(a[3]))));
    const auto& p = view.camera_t_platform;
    const V pull_z = hn::Neg(hn::Mul(inverse, hn::MulAdd(hn::Add(x, set(p[0])), pull_x,
                                                         hn::Mul(hn::Add(y, set(p[1])), pull_y))));
    rhs[0] = hn::Add(rhs[0], pull_x);
    rhs[1] = hn::Add(rhs[1], pull_y);
    rhs[2] = hn::Add(rhs[2], pull_z);
    rhs[3] = hn::Add(rhs[3], hn::MulSub(y, pull_z, hn::Mul(z, pull_y)));
    rhs[4] = hn::Add(rhs[4], hn::MulSub(z, pull_x, hn::Mul(x, pull_z)));
    rhs[5] = hn::Add(rhs[5], hn::MulSub(x, pull_y, hn::Mul(y, pull_x)));
    rhs[6] = hn::MulAdd(wrw, laplacian, rhs[6]);
    rhs[7] = hn::MulAdd(hn::Mul(wrw, depth), laplacian, rhs[7]);
    const V wrl = hn::Mul(wrw, middle);
    rhs[8] = hn::Add(rhs[8], wrl);
    rhs[9] = hn::MulAdd(wrl, across, rhs[9]);
    const V wrld = hn::Mul(wrl, down);
    rhs[10] = hn::Add(rhs[10], wrld);
    rhs[11] = hn::MulAdd(wrld, down, rhs[11]);
    rhs[12] = hn::Add(rhs[12], wrw);
    squares = hn::MulAdd(wr, residual, squares);
    weights = hn::Add(weights, w);
    inside = hn::Add(inside, valid);
  }
  const auto total = [&](V v) { return hn::GetLane(hn::SumOfLanes(d, v)); };
  for (std::size_t k = 0; k < kPatchParameters; ++k) sums.rhs[k] += total(rhs[k]);
  sums.squares += total(squares);
  sums.weights += total(weights);
  sums.inside += total(inside);
}

void sum_patches(const PixelTemplate& t, const PixelWindow& image, std::span<const PatchView> views,
                 float inverse_cut, bool keep, PixelPairs& pairs, std::span<NormalEquations> sums) {
  const auto& k = t.camera.distortion;
  const Lens lens{std::any_of(k.begin(), k.end(), [](double c) { return c != 0; }),
                  static_cast<float>(t.camera.fx_px),
                  static_cast<float>(t.camera.fy_px),
                  static_cast<float>(t.camera.cx_px),
                  static_cast<float>(t.camera.cy_px),
                  static_cast<float>(k[0]),
                  static_cast<float>(k[1]),
                  static_cast<float>(k[2]),
                  static_cast<float>(k[3]),
                  static_cast<float>(k[4])};
  Block block;
  for (std::size_t n = 0; n < t.patches.size(); ++n) {
    const PixelPatch& patch = t.patches[n];
    sums[n] = {};
    for (std::size_t done = 0; done < patch.count; done += kBlock) {
      const std::size_t count = std::min(kBlock, patch.count - done);
      const std::size_t first = patch.first + done;
      find_pixels(t, lens, image, views[n], keep, first, count, pairs, block);
      if (!keep) {
        float* level = pairs.level.data() + first;
        for (std::size_t i = 0; i < count; ++i)
          level[i] = static_cast<float>(image.pixels[block.at[i]]);
      }
      compare(t, lens, views[n], inverse_cut, first, count, pairs, block, sums[n]);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace tagwrench
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tagwrench {

HWY_EXPORT(sum_patches);

void sum_patches(const PixelTemplate& pixels, const PixelWindow& image,
                 std::span<const PatchView> views, float inverse_cut, bool keep, PixelPairs& pairs,
                 std::span<NormalEquations> sums) noexcept {
  if (image.pixels == nullptr || image.left >= image.right || image.top >= image.bottom) {
    std::fill(sums.begin(), sums.end(), NormalEquations{});
    return;
  }
  HWY_DYNAMIC_DISPATCH(sum_patches)(pixels, image, views, inverse_cut, keep, pairs, sums);
}

}  // namespace tagwrench
#endif
