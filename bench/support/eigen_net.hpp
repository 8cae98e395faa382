/// The paper's network written straightforwardly with Eigen: whole [C, V] matrices, a pass over memory for each layer.
/// The paper's order (conv, then ReLU) and per-vertex feature, one thread.
#pragma once

#include <support/reference_net.hpp>

#include <Eigen/Core>

#include <map>
#include <string>
#include <utility>

namespace bench {

using EigenMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline EigenMatrix to_eigen(const reference::Map& map) {
  using Doubles = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  return Eigen::Map<const Doubles>(map.values.data(), static_cast<Eigen::Index>(map.channels),
                                   static_cast<Eigen::Index>(map.vertices))
      .cast<float>();
}

class EigenNet {
 public:
  explicit EigenNet(const reference::Weights& weights) {
    for (const auto& [name, values] : weights) {
      if (!name.ends_with(".weight")) continue;
      const std::string layer = name.substr(0, name.size() - 7);
      const std::vector<double>& bias = weights.at(layer + ".bias");
      reference::Map map(bias.size(), values.size() / bias.size());
      map.values = values;
      layers_[layer] = {
          to_eigen(map),
          Eigen::Map<const Eigen::VectorXd>(bias.data(), static_cast<Eigen::Index>(bias.size())).cast<float>()};
    }
  }

  EigenMatrix conv(const std::string& name, const EigenMatrix& x) const {
    const Layer& layer = layers_.at(name);
    EigenMatrix y(layer.weight.rows(), x.cols());
    y.noalias() = layer.weight * x;
    y.colwise() += layer.bias;
    return y;
  }

  EigenMatrix block(const std::string& name, const EigenMatrix& x, const EigenMatrix& identity) const {
    const EigenMatrix first = unit(name, "spadain1", "conv1", x, identity);
    return unit(name, "spadain2", "conv2", first, identity) + unit(name, "spadain_res", "conv_res", x, identity);
  }

  EigenMatrix forward(const EigenMatrix& pose, const EigenMatrix& identity) const {
    EigenMatrix x = pose;
    for (const char* name : {"encoder.conv1", "encoder.conv2", "encoder.conv3"}) x = relu(instance_norm(conv(name, x)));
    EigenMatrix h(x.rows() + 3, x.cols());
    h << x, identity;
    h = block("decoder.spadain_block1", conv("decoder.conv1", h), identity);
    h = block("decoder.spadain_block2", conv("decoder.conv2", h), identity);
    h = block("decoder.spadain_block3", conv("decoder.conv3", h), identity);
    return conv("decoder.conv4", h).array().tanh();
  }

 private:
  struct Layer {
    EigenMatrix weight;
    Eigen::VectorXf bias;
  };

  static EigenMatrix relu(EigenMatrix x) {
    x = x.cwiseMax(0.0F);
    return x;
  }
  static EigenMatrix instance_norm(EigenMatrix x) {
    const Eigen::VectorXf mean = x.rowwise().mean();
    x.colwise() -= mean;
    const Eigen::ArrayXf inverse = (x.array().square().rowwise().mean() + 1e-5F).rsqrt();
    x.array().colwise() *= inverse;
    return x;
  }
  EigenMatrix unit(const std::string& block, const char* norm, const char* convolution, const EigenMatrix& x,
                   const EigenMatrix& identity) const {
    const std::string name = block + "." + norm;
    EigenMatrix y = instance_norm(x);
    y = conv(name + ".conv_weight", identity).cwiseProduct(y) + conv(name + ".conv_bias", identity);
    return relu(conv(block + "." + convolution, y));
  }

  std::map<std::string, Layer> layers_;
};

}  // namespace bench
