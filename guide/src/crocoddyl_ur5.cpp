// A UR5 as a DifferentialActionModel of Crocoddyl over exported dynamics: the cost is ½ |u|² + ½ |q̇|². Prints how far Fx and Fu are from
// Crocoddyl's own difference quotients.
#include "ur5_dynamics.h"
#define OC_ROBOT ur5
#define OC_NV UR5_NV
#include "optimal_control.h"

#include <crocoddyl/core/diff-action-base.hpp>
#include <crocoddyl/core/numdiff/diff-action.hpp>
#include <crocoddyl/core/states/euclidean.hpp>
#include <iostream>

class Ur5 : public crocoddyl::DifferentialActionModelAbstract {
 public:
  typedef crocoddyl::DifferentialActionDataAbstract Data;
  Ur5()
      : crocoddyl::DifferentialActionModelAbstract(
            std::make_shared<crocoddyl::StateVector>(2 * UR5_NV), UR5_NV, 0) {}

  // copies for solvers in double; the exported functions have no other numbers
  std::shared_ptr<crocoddyl::DifferentialActionModelBase> cloneAsDouble() const override { return std::make_shared<Ur5>(); }
  std::shared_ptr<crocoddyl::DifferentialActionModelBase> cloneAsFloat() const override { return nullptr; }

  void calc(const std::shared_ptr<Data>& data, const Eigen::Ref<const Eigen::VectorXd>& x,
            const Eigen::Ref<const Eigen::VectorXd>& u) override {
    ur5_forward_dynamics(x.data(), x.data() + UR5_NV, u.data(), data->xout.data());
    data->cost = 0.5 * u.squaredNorm() + 0.5 * x.tail<UR5_NV>().squaredNorm();
  }

  void calcDiff(const std::shared_ptr<Data>& data, const Eigen::Ref<const Eigen::VectorXd>& x,
                const Eigen::Ref<const Eigen::VectorXd>& u) override {
    ur5_oc_differential_action(x.data(), x.data() + UR5_NV, u.data(), data->xout.data(), data->Fx.data(), data->Fu.data());
    data->Lx.setZero();
    data->Lx.tail<UR5_NV>() = x.tail<UR5_NV>();
    data->Lu = u;
    data->Lxx.setZero();
    data->Lxx.bottomRightCorner<UR5_NV, UR5_NV>().setIdentity();
    data->Luu.setIdentity();
    data->Lxu.setZero();
  }
};

int main() {
  auto model = std::make_shared<Ur5>();
  Eigen::VectorXd x(2 * UR5_NV), u(UR5_NV);
  x << 0.3, -1.2, 1.5, -0.4, 1.1, 0.7, 0.5, -0.8, 0.3, 1.2, -0.6, 0.9;
  u << 5, -30, 12, 3, -1, 0.5;
  auto data = model->createData();
  model->calc(data, x, u);
  model->calcDiff(data, x, u);
  crocoddyl::DifferentialActionModelNumDiff quotients(model);
  auto other = quotients.createData();
  quotients.calc(other, x, u);
  quotients.calcDiff(other, x, u);
  auto off = [](const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
    return (a - b).cwiseAbs().maxCoeff() / (1.0 + b.cwiseAbs().maxCoeff());
  };
  std::cout << off(data->Fx, other->Fx) << " " << off(data->Fu, other->Fu) << "\n";
  return 0;
}
