"""A table with something hidden in it: name it, add it, and see the error fall to the noise floor."""

import xy_sysid as xy

table = xy.simulate(60, hidden=12)
run = table.run("x")
print(run)

found = xy.diagnose(run)
print(found.sentence)
print("Runner-up:", found.runner_up or "none near. Next experiment:", found.next_experiment)

steps = xy.refine(run)
for step in steps:
    print(f"{step.added or 'rigid':20} {1e3 * step.held_out_error:8.3f} mm/s, floor {1e3 * step.noise_floor:.3f}")
for item in steps.model.parameters:
    print(f"{item.name:20} {item.value:.4g} [{item.low:.4g}, {item.high:.4g}] {item.unit}")

xy.plot.ladder(steps).write_html("ladder.html", include_plotlyjs="cdn")
xy.save(steps.model, "axis_x.yaml", force=True)
