"""Examples of every command, which end its help."""

EXAMPLES: dict[str, tuple[tuple[str, str], ...]] = {
    "run": (
        ("gudgeon run data/skirt", "all stages: mesh, modes, morph, solve, plot"),
        ("gudgeon run data/skirt --set run.duration=2e-4", "with another value of a key"),
        ("gudgeon run data/skirt --tolerance 1%", "the cheapest setting that `gudgeon report` found"),
    ),
    "mesh": (("gudgeon mesh data/skirt", "size, mass and inertia of the parts"),),
    "modes": (("gudgeon modes data/skirt", "frequencies of the parts, with estimated errors"),),
    "morph": (
        (
            "gudgeon morph data/skirt --set component.skirt.change.profile.table=barrel-20um.csv",
            "nodes move, modes are kept",
        ),
    ),
    "solve": (("gudgeon solve data/skirt", "quantities of the run, without pictures"),),
    "plot": (("gudgeon plot data/skirt", "pictures and film, in out/skirt/scene"),),
    "status": (("gudgeon status data/skirt --set component.skirt.mesh.size=0.004", "what would be computed, and why"),),
    "plan": (("gudgeon plan data/rod-wall", "what the solver reads and omits, and its integrator"),),
    "report": (
        ("gudgeon report data/beam-sphere", "report.html: error against run time"),
        ("gudgeon report data/beam-sphere --tolerance 0.1%", "the cheapest setting below 0.1 %"),
    ),
    "study": (("gudgeon study data/rod-wall --vary body.rod.velocity.0=0.1:1:10", "ten speeds, one table"),),
    "family": (
        (
            "gudgeon family data/skirt --vary component.skirt.change.profile.offset=-2e-4:2e-4",
            "designs to store, and the lines of the scene",
        ),
    ),
    "wear": (
        ("gudgeon wear data/clearance-joint/wear.toml --period 0.012", "worn depth over the angle, and a picture"),
        ("gudgeon wear data/piston/wear.toml --cycles 1e6", "worn depth of the skirt and of the liner"),
    ),
    "robustness": (("gudgeon robustness data/two-mass --only units,turned", "two groups of cases"),),
    "linear": (
        (
            "gudgeon linear data/held-beam --force contact.stop --frequencies 10 5000",
            "modes with the contacts that press, and a response",
        ),
    ),
    "calibrate": (
        ("gudgeon calibrate data/base-sensor/plate-beams.toml", "matrix from strains per unit wrench"),
        ("gudgeon calibrate data/base-sensor/plate-beams.toml --data bench.csv", "of measured wrenches and signals"),
        ("gudgeon calibrate data/base-sensor/robot-plate.toml --excite", "by the arm that moves on the plate"),
    ),
    "identify": (
        ("gudgeon identify data/base-sensor/robot.toml", "parameters.json, and excitation.csv for a real arm"),
        ("gudgeon identify data/base-sensor/robot.toml --data samples.csv", "of measured samples"),
    ),
    "wrench": (
        ("gudgeon wrench data/base-sensor/robot-plate.toml", "wrench on the tool, and its errors by source"),
        ("gudgeon wrench data/base-sensor/robot.toml --parameters parameters.json", "by identified parameters"),
    ),
    "signals": (("gudgeon signals data/base-sensor/plate-beams.toml", "signals of its bridges over time"),),
    "infer": (("gudgeon infer calibration.json signals.csv", "wrenches, in signals-wrench.csv"),),
    "feel": (
        ("gudgeon feel data/pull-in", "the force on the plate, in a browser"),
        ("gudgeon feel data/pull-in --script poses.csv", "poses from a table, forces in feel.csv"),
    ),
    "export": (
        ("gudgeon export data/skirt results", ".vtu files for ParaView"),
        ("gudgeon export data/skirt skirt --format abaqus", "the reduced body for another program"),
    ),
    "faces": (("gudgeon faces bracket.step", "numbered faces, and rules that name them in a scene"),),
    "new": (("gudgeon new bracket.step", "the folder bracket with a scene that runs"),),
    "doctor": (("gudgeon doctor", "what is missing on this machine"),),
    "example": (
        ("gudgeon example list", "scenes of the package"),
        ("gudgeon example copy two-blocks", "the folder two-blocks"),
    ),
    "schema": (
        ("gudgeon schema component.interface", "the keys of a table"),
        ("gudgeon schema run.step", "one key"),
        ("gudgeon schema > scene.schema.json", "for editors"),
    ),
    "completion": (
        ("source <(gudgeon completion bash)", "in ~/.bashrc"),
        ('eval "$(gudgeon completion zsh)"', "in ~/.zshrc, after compinit"),
        ("gudgeon completion fish | source", "in config.fish"),
        ("gudgeon completion tcsh > ~/.gudgeon.tcsh", "and `source ~/.gudgeon.tcsh` in ~/.tcshrc"),
    ),
}


def examples_of(command: str) -> str:
    """Return the examples of a command as text; empty if it has none."""
    if command not in EXAMPLES:
        return ""
    width = max(len(text) for text, _ in EXAMPLES[command])
    lines = [
        f"  {text.ljust(width)}  {meaning}" if width < 60 else f"  {text}\n      {meaning}"
        for text, meaning in EXAMPLES[command]
    ]
    return "\n".join(["examples:", *lines])
