#include "bench/shift_methods.h"

#include <cmath>
#include <ctime>

#ifdef SHIFTRIG_HAVE_CVODE
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#endif

namespace shiftrig {
namespace {

using reference::Matrix;
using reference::Solver;
using reference::Vector;
using reference::When;

double cpu_time() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// The shift at the end of its warm-up, which all methods share.
struct Problem {
    explicit Problem(const cases::TractorShift& s)
        : shift(s), system(cases::tractor_system(s, start_speeds(s))), solver(system) {
        const auto before = solver.run(shift.warm_up, {.step = 1e-4, .resolution = 1});
        trace.rows.push_back(shift_row(system, before.samples.back()));
    }
    void record(double t) { trace.rows.push_back(shift_row(system, solver.sample({t, t}))); }

    const cases::TractorShift& shift;
    reference::System system;
    Solver solver;
    // Finding the mode after an event tries combinations until one is consistent: a price of the reference
    // solver, not of the integrator, and therefore kept apart.
    void change_state(double t) {
        const double from = cpu_time();
        solver.apply_violations({t, t});
        seconds_of_changes += cpu_time() - from;
    }

    ShiftTrace trace;
    long evaluations = 0;
    double seconds_of_changes = 0;
};

void runge_kutta(Problem& p, double t, double h, Vector& out) {
    static thread_local Vector k1, k2, k3, k4, stage;
    const Vector& z = p.solver.z;
    p.solver.rates({t, t}, z, k1);
    stage = z + h / 2 * k1;
    p.solver.rates({t + h / 2, t}, stage, k2);
    stage = z + h / 2 * k2;
    p.solver.rates({t + h / 2, t}, stage, k3);
    stage = z + h * k3;
    p.solver.rates({t + h, t}, stage, k4);
    out = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    p.evaluations += 4;
}

// z1 = z0 + h f(z1) by Newton steps with a Jacobian kept as long as mode and step size stay.
class ImplicitEuler {
  public:
    bool advance(Problem& p, double t, double h, Vector& out) {
        const auto n = p.solver.z.size();
        if (h != h_ || !(p.solver.mode == mode_)) factor(p, t, h);
        out = p.solver.z;
        Vector f;
        for (int i = 0; i < 8; ++i) {
            p.solver.rates({t + h, t}, out, f);
            ++p.evaluations;
            const Vector correction = lu_.solve(p.solver.z + h * f - out);
            out += correction;
            const double size = correction.cwiseQuotient(out.cwiseAbs() + Vector::Constant(n, 1e-3))
                                    .lpNorm<Eigen::Infinity>();
            if (size < 1e-8) return true;
            if (!std::isfinite(size)) return false;
        }
        h_ = 0;  // slow: refresh the Jacobian next time
        return true;
    }

  private:
    void factor(Problem& p, double t, double h) {
        const auto n = p.solver.z.size();
        Matrix jacobian(n, n);
        Vector z = p.solver.z, base, moved;
        p.solver.rates({t, t}, z, base);
        for (Eigen::Index i = 0; i < n; ++i) {
            const double keep = z[i], delta = 1e-7 * std::max(1.0, std::abs(keep));
            z[i] += delta;
            p.solver.rates({t, t}, z, moved);
            jacobian.col(i) = (moved - base) / delta;
            z[i] = keep;
        }
        p.evaluations += n + 1;
        lu_.compute(Matrix::Identity(n, n) - h * jacobian);
        h_ = h;
        mode_ = p.solver.mode;
    }
    double h_ = 0;
    reference::Mode mode_;
    Eigen::PartialPivLU<Matrix> lu_;
};

// Fixed steps between whole milliseconds and kinks of the pressures; the first change of contact in a
// step is found by regula falsi and the step repeated up to it.
template <class Advance>
bool run_fixed(Problem& p, long steps_per_millisecond, Advance advance) {
    const long milliseconds = std::lround(p.shift.duration * 1000);
    const double start = p.shift.warm_up;
    double t = start;
    std::size_t next_break = 0;
    Vector end, g0, g1, g;
    for (long k = 1; k <= milliseconds; ++k) {
        const double grid = start + 1e-3 * static_cast<double>(k);
        while (t < grid - 1e-12) {
            while (next_break < p.system.breaks.size() && p.system.breaks[next_break] <= t + 1e-9)
                ++next_break;
            double stop = grid;
            if (next_break < p.system.breaks.size()) stop = std::min(stop, p.system.breaks[next_break]);
            const auto steps = static_cast<long>(
                std::ceil((stop - t) * 1e3 * static_cast<double>(steps_per_millisecond) - 1e-6));
            const double h = (stop - t) / static_cast<double>(std::max(steps, 1L));
            for (long i = 0; i < std::max(steps, 1L); ++i) {
                double from = t + static_cast<double>(i) * h, left = h;
                for (int events = 0; events < 40; ++events) {
                    if (!advance(p, from, left, end) || !end.allFinite()) return false;
                    p.solver.margins({from + left, from}, end, g1);
                    if ((g1.array() >= 0).all()) break;
                    p.solver.margins({from, from}, p.solver.z, g0);
                    double low = 0, high = 1, g_low = 1, g_high = -1;
                    const auto lowest =
                        [&](const Vector& values) {  // share of the interval the worst has used up
                            double worst = 1;
                            for (Eigen::Index j = 0; j < values.size(); ++j)
                                if (g1[j] < 0) worst = std::min(worst, values[j] / std::max(g0[j], 1e-300));
                            return worst;
                        };
                    g_low = lowest(g0);
                    g_high = lowest(g1);
                    for (int iteration = 0; iteration < 30 && (high - low) * left > 1e-10; ++iteration) {
                        double middle = low + (high - low) * g_low / (g_low - g_high);
                        if (iteration % 3 == 2 || !(middle > low && middle < high)) middle = (low + high) / 2;
                        if (!advance(p, from, middle * left, end)) return false;
                        p.solver.margins({from + middle * left, from}, end, g);
                        (g.array() < 0).any() ? (high = middle, g_high = std::min(lowest(g), -1e-12))
                                              : (low = middle, g_low = lowest(g));
                    }
                    if (!advance(p, from, high * left, end)) return false;
                    p.solver.z = end;
                    from += high * left;
                    left *= 1 - high;
                    p.change_state(from);
                }
                p.solver.z = end;
            }
            t = stop;
        }
        p.record(t);
    }
    return p.trace.rows.back()[0] > 0;
}

#ifdef SHIFTRIG_HAVE_CVODE

struct CvodeContext {
    Problem& problem;
    Vector z, dz, g;
};

int cvode_rates(sunrealtype t, N_Vector y, N_Vector ydot, void* user) {
    auto& c = *static_cast<CvodeContext*>(user);
    c.z = Eigen::Map<Vector>(N_VGetArrayPointer(y), c.z.size());
    c.problem.solver.rates({t, t}, c.z, c.dz);
    Eigen::Map<Vector>(N_VGetArrayPointer(ydot), c.z.size()) = c.dz;
    ++c.problem.evaluations;
    return 0;
}

int cvode_margins(sunrealtype t, N_Vector y, sunrealtype* out, void* user) {
    auto& c = *static_cast<CvodeContext*>(user);
    c.z = Eigen::Map<Vector>(N_VGetArrayPointer(y), c.z.size());
    c.problem.solver.margins({t, t}, c.z, c.g);
    std::copy(c.g.data(), c.g.data() + c.g.size(), out);
    return 0;
}

bool run_cvode(Problem& p, double tolerance) {
    SUNContext context = nullptr;
    if (SUNContext_Create(nullptr, &context) != 0) return false;
    CvodeContext c{p, p.solver.z, {}, {}};
    const auto n = p.solver.z.size();
    const double start = p.shift.warm_up;
    p.solver.margins({start, start}, p.solver.z, c.g);
    N_Vector y = N_VNew_Serial(n, context), absolute = N_VNew_Serial(n, context);
    Eigen::Map<Vector>(N_VGetArrayPointer(y), n) = p.solver.z;
    // Twists are 1e-2 rad, slip 1e-1, speeds 1 to 200, engine torque 1e3: absolute tolerances of that scale.
    for (Eigen::Index i = 0; i < n; ++i)
        NV_Ith_S(absolute, i) = tolerance * (i < p.system.masses                     ? 1.0
                                             : i < p.system.masses + p.system.shafts ? 1e-2
                                                                                     : 1e-1);
    SUNMatrix matrix = SUNDenseMatrix(n, n, context);
    SUNLinearSolver linear = SUNLinSol_Dense(y, matrix, context);
    void* cvode = CVodeCreate(CV_BDF, context);
    bool good = CVodeInit(cvode, cvode_rates, start, y) == CV_SUCCESS &&
                CVodeSVtolerances(cvode, tolerance, absolute) == CV_SUCCESS &&
                CVodeSetUserData(cvode, &c) == CV_SUCCESS &&
                CVodeSetLinearSolver(cvode, linear, matrix) == CV_SUCCESS &&
                CVodeSetMaxNumSteps(cvode, 100000) == CV_SUCCESS &&
                CVodeRootInit(cvode, static_cast<int>(c.g.size()), cvode_margins) == CV_SUCCESS;
    CVodeSetNoInactiveRootWarn(cvode);
    const long milliseconds = std::lround(p.shift.duration * 1000);
    double t = start;
    for (long k = 1; k <= milliseconds && good; ++k) {
        const double grid = start + 1e-3 * static_cast<double>(k);
        for (int restarts = 0; good; ++restarts) {
            const int flag = CVode(cvode, grid, y, &t, CV_NORMAL);
            good = flag >= 0 && restarts < 200;
            p.solver.z = Eigen::Map<Vector>(N_VGetArrayPointer(y), n);
            if (flag != CV_ROOT_RETURN) break;
            // CVODE stops on the near side of a root: step over it, then change the state.
            const double over = t + 1e-9;
            p.solver.rates({t, t}, p.solver.z, c.dz);
            p.solver.z += 1e-9 * c.dz;
            p.change_state(over);
            Eigen::Map<Vector>(N_VGetArrayPointer(y), n) = p.solver.z;
            good = good && CVodeReInit(cvode, over, y) == CV_SUCCESS;
        }
        p.record(t);
    }
    CVodeFree(&cvode);
    SUNLinSolFree(linear);
    SUNMatDestroy(matrix);
    N_VDestroy(y);
    N_VDestroy(absolute);
    SUNContext_Free(&context);
    return good;
}

#endif

}  // namespace

bool has_cvode() {
#ifdef SHIFTRIG_HAVE_CVODE
    return true;
#else
    return false;
#endif
}

std::optional<MethodRun> run_textbook(const cases::TractorShift& shift, TextbookMethod method,
                                      double precision) {
    Problem problem(shift);
    bool good = false;
    const double from = cpu_time();
    switch (method) {
        case TextbookMethod::runge_kutta_4:
            good =
                run_fixed(problem, std::lround(precision), [](Problem& p, double t, double h, Vector& out) {
                    runge_kutta(p, t, h, out);
                    return true;
                });
            break;
        case TextbookMethod::implicit_euler: {
            ImplicitEuler euler;
            good = run_fixed(
                problem, std::lround(precision),
                [&](Problem& p, double t, double h, Vector& out) { return euler.advance(p, t, h, out); });
            break;
        }
        case TextbookMethod::cvode_bdf:
#ifdef SHIFTRIG_HAVE_CVODE
            good = run_cvode(problem, precision);
#endif
            break;
    }
    const double seconds = cpu_time() - from - problem.seconds_of_changes;
    if (!good) return std::nullopt;
    MethodRun run{problem.trace, problem.evaluations};
    run.trace.seconds = seconds;
    return run;
}

}  // namespace shiftrig
