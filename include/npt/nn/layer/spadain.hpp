/// Spatially adaptive instance normalisation (Wang et al., CVPR 2020, section 3.3, eq. 1-3, Table 4).
///   y[c, v] = gamma_c(p_v) * (x[c, v] - mean_c) / sqrt(var_c + eps) + beta_c(p_v)
/// Shapes     x, y: [C, V]   p: [Cond, V], the condition: in the paper the identity mesh, normalised
/// Numerics   biased variance over V, eps = 1e-5; NaN in gives NaN out
/// Gradients  gamma.weight, gamma.bias, beta.weight, beta.bias, x, p
///
/// gamma and beta are 1x1 convolutions of the conditioning mesh. They are evaluated in registers where y is used and
/// never stored: about 8 multiply-adds an element, under 1 % of the work of the convolution behind it.
#pragma once

#include <npt/config.hpp>
#include <npt/nn/kernel/pointwise.hpp>
#include <npt/nn/layer/conv1x1.hpp>
#include <npt/nn/layer/instance_norm.hpp>
#include <npt/nn/layer/parameter.hpp>

#include <cstddef>

namespace npt::inline NPT_ABI {

/// The modulation alone: y[c, v] = gamma_c(p_v) * x[c, v] + beta_c(p_v).
template <int Cond>
struct Modulate : kernel::Pointwise {
  static constexpr const char* name = "modulate";
  static constexpr std::size_t index(int i) { return static_cast<std::size_t>(i); }
  template <class T>
  struct Row {
    simd::Batch<T> gamma[index(Cond + 1)], beta[index(Cond + 1)];
  };
  template <class T>
  struct Column {
    simd::Batch<T> p[index(Cond)];
  };
  template <class T>
  static NPT_ALWAYS_INLINE Column<T> column(const kernel::PointwiseArgs<T>& args, kernel::Position at) {
    const T* tile = args.other + kernel::panel_stride<T>(Cond) * static_cast<std::size_t>(at.panel);
    Column<T> column;
    simd::unroll<Cond>([&](auto i) NPT_LAMBDA_INLINE {
      column.p[i] = simd::load(tile + i * kernel::panel_width<T> + at.half * simd::lanes<T>);
    });
    return column;
  }
  template <class T>
  static NPT_ALWAYS_INLINE Row<T> row(const kernel::PointwiseArgs<T>& args, int c) {
    Row<T> row;
    simd::unroll<Cond>([&](auto i) NPT_LAMBDA_INLINE {
      row.gamma[i] = simd::broadcast(args.parameters[0][c * Cond + i]);
      row.beta[i] = simd::broadcast(args.parameters[2][c * Cond + i]);
    });
    row.gamma[Cond] = simd::broadcast(args.parameters[1][c]);
    row.beta[Cond] = simd::broadcast(args.parameters[3][c]);
    return row;
  }
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> apply(simd::Batch<T> x, const Row<T>& row, const Column<T>& column) {
    simd::Batch<T> gamma = row.gamma[Cond];
    simd::Batch<T> beta = row.beta[Cond];
    simd::unroll<Cond>([&](auto i) NPT_LAMBDA_INLINE {
      gamma = simd::fma(row.gamma[i], column.p[i], gamma);
      beta = simd::fma(row.beta[i], column.p[i], beta);
    });
    return simd::fma(gamma, x, beta);
  }

  /// Sums in the order of the parameters: gamma's weights and bias, beta's weights and bias.
  static constexpr int sums_per_channel = 2 * (Cond + 1);
  template <class T>
  static NPT_ALWAYS_INLINE simd::Batch<T> vjp(const simd::Batch<T>& x, const simd::Batch<T>& dy, const Row<T>& row,
                                              const Column<T>& column, simd::Batch<T>* sums) {
    simd::Batch<T> gamma = row.gamma[Cond];
    const simd::Batch<T> product = dy * x;
    simd::unroll<Cond>([&](auto i) NPT_LAMBDA_INLINE {
      gamma = simd::fma(row.gamma[i], column.p[i], gamma);
      sums[i] = simd::fma(product, column.p[i], sums[i]);
      sums[Cond + 1 + i] = simd::fma(dy, column.p[i], sums[Cond + 1 + i]);
    });
    sums[Cond] += product;
    sums[2 * Cond + 1] += dy;
    return dy * gamma;
  }
  static constexpr int other_channels = Cond;
  template <class T>
  static NPT_ALWAYS_INLINE void other_vjp(const simd::Batch<T>& x, const simd::Batch<T>& dy, const Row<T>& row,
                                          const Column<T>&, simd::Batch<T>* sums) {
    const simd::Batch<T> product = dy * x;
    simd::unroll<Cond>([&](auto i) NPT_LAMBDA_INLINE {
      sums[i] = simd::fma(product, row.gamma[i], simd::fma(dy, row.beta[i], sums[i]));
    });
  }
};

/// Whether SPAdaIN normalises. The first block of the compact-feature network doesn't (supplement C.2 and D.5).
enum class Norm { instance, none };

template <int C, int Cond = 3, Norm Normalise = Norm::instance>
struct SPAdaIN {
  static constexpr int channels = C;
  using Operation = Modulate<Cond>;

  Conv1x1<Cond, C> gamma;
  Conv1x1<Cond, C> beta;

  /// The public state dict calls gamma's convolution conv_weight and beta's conv_bias.
  static constexpr void visit(auto& self, auto&& visitor) {
    visitor("conv_weight", self.gamma);
    visitor("conv_bias", self.beta);
  }

  constexpr auto operator()(auto x, auto condition) const {
    if constexpr (Normalise == Norm::instance)
      return conditioned(x | instance_norm, *this, condition);
    else
      return conditioned(x, *this, condition);
  }
};

}  // namespace npt::inline NPT_ABI
