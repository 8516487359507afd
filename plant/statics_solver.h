// Torques of a machine at rest or in steady motion: the unknowns of statics.h, and what they have to fulfil. Internal to plant/.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <vector>

#include "plant/plant.h"
#include "plant/rigid_set.h"
#include "plant/statics.h"
#include "plant/structure.h"

namespace shiftrig::plant::detail {

class StaticsSolver {
  public:
    StaticsSolver(const Description& d, const StaticsProblem& problem);
    StaticsResult solve();

  private:
    // ---- the problem, and how everything turns
    [[noreturn]] void fail(const std::string& field, const std::string& rule) const {
        throw ModelError("statics", description_.name, field, rule);
    }
    const std::string& name_of(Eigen::Index mass) const {
        return structure_.mass_names[static_cast<std::size_t>(mass)];
    }
    bool is_translating(int mass) const {
        return description_.masses[static_cast<std::size_t>(mass)].motion == Motion::translating;
    }
    int node(const std::string& field, const std::string& name) const;
    double number(const std::string& field, const std::string& name, double value) const;
    void read_nodes();
    // ω = B q with the motions B that the rigid set allows, q from the given speeds; what they leave open
    // is set to rest and remembered.
    void find_speeds();
    bool can_move(int mass) const;
    // Nᵀθ = 0 as rows on the torques: around every loop the twists of the shafts add up to nothing.
    void find_loops();
    double meshing_speed(const Mesh& mesh) const;
    bool is_open(const Mesh& mesh) const;

    // ---- torques, and the directions of power that agree with them
    // Load-independent loss of a mesh as it acts on links 2 and carrier (+u, −u), with the sign of the motion.
    double bearing(std::size_t m) const;
    // Σ_k Â_jk M_k − Σ_absorbers T = T_j for all nodes: unknown M, then what the absorbing nodes take. What is out of
    // balance is left as a residual of the smallest Σ r²/J, so that torques come near those of the accelerating machine.
    void solve_torques();
    // The torques, with losses unless ideal. False: nothing holds what the inputs put in.
    bool settle();
    bool is_balanced() const { return residual_.cwiseAbs().maxCoeff() <= 1e-7 * scale_; }
    // x that mesh m should have by the present torques.
    int wanted_direction(std::size_t m) const;
    void settle_directions();
    // The mesh with the largest torque whose x is wrong; the number of meshes: none is.
    std::size_t worst_direction(double scale) const;
    // Flipping one by one may miss the directions in which loads are in balance: tries all of them, where they are few. What
    // was there stays if none is better.
    void search_directions();

    // ---- what is said of it (statics.cpp)
    // Names what accelerates, and at which node what other torque would keep the balance.
    [[noreturn]] void refuse_imbalance(const std::string& open_mesh = "");
    bool is_anything_open() const;
    // What is said to be closed has to be able to pass on its torque. Where a tie-up leaves the split open, the sign of a
    // torque means nothing.
    void check_limits() const;
    // Does device k take part in any of these sets of torques?
    static bool is_part_of(const Eigen::MatrixXd& torques, std::size_t k);
    StaticsResult report() const;

    const Description& description_;
    const StaticsProblem& problem_;
    Structure structure_;
    RigidSet set_;
    bool ideal_ = false;
    int input_ = -1, output_ = -1;
    std::vector<int> loaded_;     // nodes with an input
    std::vector<int> absorbers_;  // the output, unless closed devices hold it
    Eigen::VectorXd external_, speed_, torque_, residual_;
    Eigen::MatrixXd basis_, open_, force_, compatibility_;
    Eigen::MatrixXd in_loops_,
        undecided_;     // torques that leave every balance as it is; those that stiffness leaves open
    double scale_ = 0;  // largest torque
    std::vector<int> x_;
    bool directions_settled_ = true;
};

// "C1,C3", or "nothing".
std::string listed(const std::vector<std::string>& names);

}  // namespace shiftrig::plant::detail
