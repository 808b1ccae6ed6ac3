// The relief valve of benches/relief_valve.rs by Boost's odeint, one system after the other.
//
//     relief_valve OUT MEMBERS
//
// The controlled stepper runge_kutta_dopri5 with the same tolerances, events and rule for the seat; an event is
// found by the Illinois method on the length of the step. Prints processor seconds.

#include <array>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

namespace odeint = boost::numeric::odeint;
using State = std::array<double, 3>;

static const double KAPPA = 1.25, DELTA = 10.0, BETA = 20.0, RESTITUTION = 0.8, TOLERANCE = 1e-10;
static const double NEAR_SEAT = 1e-12, NEAR_EXTREMUM = 1e-7, STICKS = 1e-5, AT_REST = 1e-9;
static const size_t PASSED_OVER = 2048, KEPT = 64;

struct Valve {
    double q;
    void operator()(const State &y, State &rate, double) const {
        rate[0] = y[1];
        rate[1] = y[2] - (y[0] + DELTA) - KAPPA * y[1];
        rate[2] = BETA * (q - y[0] * std::sqrt(std::fmax(y[2], 0.0)));
    }
};

static std::vector<double> heights(double q) {
    Valve valve{q};
    odeint::runge_kutta_dopri5<State> plain;
    auto controlled = odeint::make_controlled(TOLERANCE, TOLERANCE, plain);
    State y{0.2, 0.0, 0.0}, to, rate, last;
    double h = 0.01, rising = -1.0, before = INFINITY;
    size_t events = 0;
    std::vector<double> kept;
    while (kept.size() < KEPT) {
        const State from = y;
        const double wanted = h;
        double t = 0.0;
        if (controlled.try_step(valve, y, t, h) == odeint::fail) continue;
        if (!(y[0] < NEAR_SEAT && y[1] < 0.0) && !(rising * y[1] < NEAR_EXTREMUM)) continue;
        valve(from, rate, 0.0);
        // How far each event is from the end of a step of this length: negative beyond it.
        auto seat = [](const State &s) { return s[0]; };
        auto extremum = [&](const State &s) { return rising * s[1]; };
        auto find = [&](auto distance, double near) {
            double low = 0.0, high = wanted, at = wanted, below = distance(from), above = distance(y);
            to = y;
            for (int k = 0; k < 60 && std::fabs(distance(to)) > near; k++) {
                at = below > 0.0 && k % 3 < 2 ? (low * above - high * below) / (above - below) : 0.5 * (low + high);
                plain.do_step(valve, from, rate, 0.0, to, last, at);
                const double found = distance(to);
                if (found < 0.0) { high = at; above = found; } else { low = at; below = found; }
            }
            return at;
        };
        const bool left = extremum(from) > NEAR_EXTREMUM || rising * rate[1] > 0.0;
        const bool falls = y[0] < NEAR_SEAT && y[1] < 0.0, turns = left && rising * y[1] < NEAR_EXTREMUM;
        double least = INFINITY;
        bool impact = false;
        State found = y;
        if (turns) {
            least = find(extremum, NEAR_EXTREMUM);
            found = to;
        }
        // An extremum below the seat comes after the impact.
        if (falls && (!turns || found[0] < NEAR_SEAT)) {
            least = find(seat, NEAR_SEAT);
            found = to;
            impact = true;
        }
        if (least == INFINITY) continue;
        y = found;
        h = wanted;
        if (impact) {
            const double speed = -RESTITUTION * y[1];
            y = speed < STICKS && y[2] < DELTA ? State{0.0, 0.0, DELTA} : State{0.0, speed, y[2]};
            rising = 1.0;
        } else {
            rising = -rising;
        }
        controlled = odeint::make_controlled(TOLERANCE, TOLERANCE, plain);  // its first stage is of another place
        if (events >= PASSED_OVER) kept.push_back(y[0]);
        events++;
        if (y[0] > AT_REST && std::fabs(y[0] - before) < AT_REST) kept.resize(KEPT, y[0]);
        before = y[0];
    }
    return kept;
}

int main(int count, char **given) {
    if (count != 3) return 2;
    const int members = std::atoi(given[2]);
    std::FILE *out = std::fopen(given[1], "w");
    double seconds = 0.0;
    for (int member = 0; member < members; member++) {
        const double q = 0.2 + 9.8 * member / std::max(members - 1, 1);
        const std::clock_t start = std::clock();
        const std::vector<double> kept = heights(q);
        seconds += double(std::clock() - start) / CLOCKS_PER_SEC;
        std::fprintf(out, "%.17g", q);
        for (double height : kept) std::fprintf(out, " %.17g", height);
        std::fprintf(out, "\n");
    }
    std::fclose(out);
    std::printf("%.9g\n", seconds);
    return 0;
}
