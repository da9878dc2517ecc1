"""Faults of the native core: expressions, all compiled into one module that reads the number of the one that holds."""

from tests.mutants.fault import Fault, faults

LAWS = ["tests/solver/laws/test_laws.py", "tests/contracts/test_laws.py"]
LCP = ["tests/solver/contact/test_lcp.py", "tests/solver/contact/test_compliance.py"]
LOG = ["tests/solver/integrators/test_impact_log.py"]
IMPACTS = ["tests/solver/integrators/small/test_impacts.py"]
SPLINES = ["tests/solver/integrators/turning/test_surfaces.py"]
PRESSED = ["tests/solver/integrators/turning/test_ground.py", "tests/solver/integrators/turning/test_surfaces.py"]

NATIVE: list[Fault] = [
    *faults(
        "laws", "solver/core/laws/power.hpp", LAWS,
        ("d * std::sqrt(d)", "d * d"),
        ("approach > 0.0 ? law[2] / approach : 0.0", "law[2] * approach"),
        ("elastic * swell + law[3] * rate", "elastic * swell - law[3] * rate"),
        ("law[1] * elastic / d * swell", "elastic / d * swell"),
        ("elastic * per_rate + law[3]", "elastic * per_rate"),
        ("law[0] * power_of(d, law[1]) * d / (law[1] + 1.0)", "law[0] * power_of(d, law[1]) * d / law[1]"),
        ("GAUSS_POINTS[point] * width", "0.4 * width"),
        ("(law_energy(law, after) - law_energy(law, before)) / width",
         "(law_energy(law, after) + law_energy(law, before)) / width"),
        ("force <= 0.0", "force < -1e300"),
    ),
    *faults(
        "response", "solver/core/response/complementarity.hpp", LCP,
        ("multipliers[i] < 0.0 && multipliers[i] < -tolerance / between(matrix.pattern, matrix.values, i, i)",
         "multipliers[i] < -1e300"),
        ("(y[a] - dot(row, solved)) * over[a]", "(y[a] + dot(row, solved)) * over[a]"),
        ("pivot <= SINGULAR * diagonal", "pivot < -1e300"),
        ("-g[active.rows[a]]", "g[active.rows[a]]"),
        ("active.expected[active.rows[a]] + y[a]", "y[a]"),
        ("cos[b] * left + sin[b] * right", "cos[b] * left - sin[b] * right"),
        ("std::sqrt(diagonal * diagonal + right * right)", "std::abs(diagonal)"),
        ("(y[a + 2] - y2 - L[r + a] * y0 - L[r + a + 1] * y1) * over[a + 2]",
         "(y[a + 2] - y2 - L[r + a] * y0) * over[a + 2]"),
        ("(y[a + 1] - L[s + a + 1] * y3 - L[r + a + 1] * y2) * over[a + 1]",
         "(y[a + 1] - L[s + a + 1] * y3) * over[a + 1]"),
    ),
    *faults(
        "response", "solver/core/response/pairs.hpp", ["tests/solver/integrators/small/test_slides.py"],
        ("along - x[0]", "x[0] - along"),
        ("state.slides.over[i] ? state.slides.free[i] : state.gap[i]", "state.gap[i]"),
    ),
    *faults(
        "log", "solver/core/log/impacts.hpp", LOG,
        ("(double(step) + 0.5) * dt", "double(step) * dt"),
        ("last[3 + axis] + dt * (J + 0.5 * impulse)", "last[3 + axis] + dt * J"),
        ("dt * force[axis] + log.jump(k, axis)", "dt * force[axis]"),
        ("(before[axis] + sudden[axis]) * (before[axis] + sudden[axis])", "before[axis] * before[axis]"),
        ("0.5 * (plateau[SINCE] + plateau[UNTIL])", "plateau[SINCE]"),
        ("larger(-rate, 0.0)", "larger(1.0 * rate, 0.0)"),
        ("larger(rate, 0.0)", "larger(-1.0 * rate, 0.0)"),
        ("time - lesser(larger(late, 0.0), dt)", "time"),
        ("2.0 * doubly(ring, middle, since, axis, dt)", "doubly(ring, middle, since, axis, dt)"),
        ("(window * window)", "window"),
        ("double(step - log.steps(k, LAST)) * log.dt >= log.separation", "step >= log.steps(k, LAST)"),
    ),
    *faults(
        "response", "solver/core/small/impacts.hpp", IMPACTS,
        ("rate + (bounces ? constants.restitution[i] * rate : 0.0)", "rate + constants.restitution[i] * rate"),
        ("state.rate[b] - constants.belt[b]", "state.rate[b]"),
    ),
    *faults(
        "laws", "solver/core/ports/splines.hpp", SPLINES,
        ("t * t * t / 6", "t * t / 6"),
        ("1.5 * t * t - 2 * t", "1.5 * t * t + 2 * t"),
        ("hss * u * u", "hss * u"),
    ),
    *faults(
        "response", "solver/core/ports/pressing.hpp", PRESSED,
        ("radius - far", "far - radius"),
        ("c * lift - e.value", "lift - e.value"),
        ("-touch[Touch::FORCE] * friction[0] / std::sqrt(square + friction[1] * friction[1])",
         "touch[Touch::FORCE] * friction[0] / std::sqrt(square + friction[1] * friction[1])"),
        ("e.rate - dot(slope, in_frame(model, work, s, v))", "-dot(slope, in_frame(model, work, s, v))"),
        ("side ? -1.0 : 1.0", "side ? 1.0 : 1.0"),
    ),
]  # fmt: skip
