// Where the arrays of the tree lie. What the inner loops read begins on a cache line.
#include <algorithm>

#include "plant/model_data.h"
#include "plant/tree.h"

namespace shiftrig::plant::detail {
namespace {

constexpr int margin = 8;  // a cache line: the inner loops read and write whole blocks

// Hands out one kind of memory part by part, or, where there is none yet, counts.
template <typename T>
class Shelf {
  public:
    explicit Shelf(T* memory) : memory_(memory) {}
    T* take(int count) {
        T* const at = memory_ ? memory_ + used_ : nullptr;
        used_ += static_cast<std::size_t>(count);
        return at;
    }
    std::size_t used() const { return used_; }

  private:
    T* memory_;
    std::size_t used_ = 0;
};

// By group or position, within a mode and in a vector of the step.
int mode_stride(const ModelData& m) {
    return whole_panels(m.tree->positions() + 1);
}
int step_stride(const ModelData& m) {
    return mode_stride(m) + 2 * margin;
}

void place_matrix(StageMatrix& matrix, Shelf<double>& shelf, int stride) {
    TreeScan &up = matrix.towards_roots, &down = matrix.towards_leaves;
    for (double** part : {&matrix.inverse, &matrix.lower, &up.by_one, &up.by_two, &up.by_four,
                          &up.from_outside, &down.by_one, &down.by_two, &down.by_four, &down.from_outside})
        *part = shelf.take(stride);
}

std::size_t place_work(const ModelData& m, TreeWork& work, double* memory) {
    Shelf<double> shelf(memory);
    const auto take = [&] {
        double* const at = shelf.take(step_stride(m));
        return at ? at + margin : nullptr;
    };
    for (double** vector : {&work.momentum, &work.way, &work.load, &work.potential}) *vector = take();
    for (double*& vector : work.stage_speed) vector = take();
    for (double*& vector : work.swing) vector = take();
    place_matrix(work.matrix, shelf, mode_stride(m));
    for (double*& vector : work.stage_effort) vector = shelf.take(whole_panels(m.forces));
    for (double*& vector : work.auxiliary_rate) vector = shelf.take(m.auxiliary);
    return shelf.used() + margin;  // blocks reach beyond the last part
}

}  // namespace

TreeSizes place_tree(const ModelData& m, TreeMode& t, const TreeMemory& memory) noexcept {
    Shelf<double> doubles(memory.doubles);
    Shelf<int> integers(memory.integers);
    const int n = mode_stride(m), grounds = static_cast<int>(m.tree->grounds.size()) + m.meshes,
              pairs = whole_panels(std::max(m.forces, m.meshes));  // by force or mesh
    for (double** array :
         {&t.ratio,        &t.force_ratio,     &t.mass,          &t.inverse_mass,    &t.drag,
          &t.stiffness,    &t.damping,         &t.loss,          &t.drag_loss,       &t.edge_own,
          &t.edge_up,      &t.network_inverse, &t.network_lower, &t.speed_factor,    &t.twist_factor,
          &t.masses.ratio, &t.shafts.ratio,    &t.inside,        &t.inner_stiffness, &t.inner_damping})
        *array = doubles.take(n);
    place_matrix(t.matrix, doubles, n);
    t.end_factor = doubles.take(2 * n);  // two ends of every link
    for (int** array :
         {&t.group, &t.first, &t.parent, &t.edge, &t.path_begin, &t.path_parent, &t.head, &t.run_begin,
          &t.run_parent, &t.speed_slot, &t.twist_slot, &t.masses.group, &t.shafts.group, &t.up, &t.spent})
        *array = integers.take(n);
    for (int** array : {&t.masses.in_line, &t.shafts.in_line})
        *array = integers.take(n / smallest_tree_block);
    t.end_group = integers.take(2 * n);
    t.end_position = integers.take(2 * n);
    t.ground_position = integers.take(grounds);
    t.ground_unknown = integers.take(grounds);
    t.ground_factor = doubles.take(whole_panels(grounds));
    t.forces.place = integers.take(pairs);
    for (GroupPairs* list : {&t.forces.slip, &t.forces.share, &t.turning}) {
        list->first = integers.take(pairs);
        list->second = integers.take(pairs);
        list->of_first = doubles.take(pairs);
        list->of_second = doubles.take(pairs);
    }
    doubles.take(panel_rows);  // blocks reach beyond the last part
    t.grounded = memory.bytes;
    t.inner = memory.masses;
    t.inner_force = memory.forces;
    t.inner_edge = memory.edges;
    const auto positions = static_cast<std::size_t>(n);
    return {.doubles = doubles.used(),
            .integers = integers.used(),
            .bytes = positions,
            .masses = positions,
            .forces = 2 * static_cast<std::size_t>(m.forces),
            .edges = positions};
}

std::size_t tree_work_size(const ModelData& m) noexcept {
    TreeWork work;
    return place_work(m, work, nullptr);
}

void place_tree_work(const ModelData& m, TreeWork& work, double* memory) noexcept {
    place_work(m, work, memory);
}

std::size_t group_state_size(const ModelData& m) noexcept {
    return std::size_t{5} * static_cast<std::size_t>(step_stride(m));
}

void place_groups(const ModelData& m, GroupState& groups, double* memory) noexcept {
    Shelf<double> shelf(memory);
    for (double** vector : {&groups.speed, &groups.twist, &groups.rate, &groups.passed, &groups.net})
        *vector = shelf.take(step_stride(m)) + margin;
}

}  // namespace shiftrig::plant::detail
