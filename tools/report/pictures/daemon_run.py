"""A calibration by the service for the README's pictures: of a virtual INS whose accelerometers creep after each turn,
which the 24-parameter model leaves out. Run inside tools/vcan_run and tools/private_bus; leaves run.json and the
recording that it names in FOLDER."""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "bench"))

import bench  # noqa: E402

PHYSICS = """[[effect]]
id = "accel_relaxation"
z = 40.0
tau_s = 45.0
"""

folder = Path(sys.argv[1])
unit = bench.Bench(folder / "bench", seed=7, speed=25.0, sim={"serial": "SN-0007"}, sim_options=["--fd"],
                   ins={"fd": True, "drift_check_s": 300.0, "schedule": "horizontal"})
(folder / "physics.toml").write_text(PHYSICS, encoding="ascii")
unit.start_ins("--physics", folder / "physics.toml")
unit.start_daemon()
try:
    run = unit.start_run("--force", "pictures of a recording with physics beyond the model")
    document = unit.wait_for_end(run, timeout=1500)
    print(f"run {run}: {document['state']} {document['reason']}".strip())
    (folder / "run.json").write_text(unit.selfcal("show", run, "--json").stdout, encoding="utf-8")
finally:
    unit.stop()
sys.exit(0 if document["state"] == "completed" else 1)
