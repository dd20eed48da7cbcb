"""The mismatch loop on vcan: concealed physics in the virtual INS, a run judged inconsistent, the physics named from the
recording that the service kept, the 24 fitted with it and written, and a simulation with it that agrees with the
recording."""
import json
import unittest

import case
import witness

# Accelerometers that creep after each turn: over a hundred sigma, so that the run must notice.
CONCEALED = """[[effect]]
id = "accel_relaxation"
x = 150.0
z = -200.0
tau_s = 6
"""


class MismatchLoop(case.OnBench):
    def test_concealed_physics_is_found_modelled_and_simulated(self):
        # 20 s dwells: 7.8 minutes are enough to separate all 24 parameters (mission: the physical limit).
        unit = self.bench(speed=60.0, ins={"dwell_s": 20.0})
        concealed = unit.folder / "concealed.toml"
        concealed.write_text(CONCEALED, encoding="ascii")
        unit.sim_options += ["--physics", str(concealed)]
        unit.start()
        run = unit.wait_for_end(unit.start_run("--schedule", "horizontal"))
        self.assertEqual(run["exit_status"], case.ANSWER_IS_NO, run["reason"])
        self.assertEqual(run["result"]["consistency"]["verdict"], "inconsistent", run["reason"])
        self.assert_old_coefficients(unit)   # such a set is never written
        # The refusal names the cause and the command that mends it, and no value is told as usable.
        self.assertEqual(run["summary"]["standing"], "bad")
        self.assertIn("creep of the accelerometers", run["summary"]["verdict"])
        self.assertIn("accel_relaxation", run["summary"]["cause"])
        self.assertEqual(run["summary"]["next"], f"selfcal amend {run['run']}")
        self.assertFalse(any(p["usable"] for p in run["result"]["parameters"]))
        truth = unit.truth()

        amended = unit.folder / "amended"
        answer = json.loads(unit.selfcal("diagnose", run["recording"], "--json", "--amended", amended, check=False).stdout)
        self.assertEqual(answer["verdict"], "named")
        self.assertEqual([f["effect"] for f in answer["findings"]], ["accel_relaxation"])
        found = {p["name"]: p for p in answer["findings"][0]["parameters"]}
        for name, size in {"x": 150.0, "z": -200.0, "tau": 6.0}.items():
            self.assertLess(abs(found[name]["value"] - size), 5.0 * found[name]["sigma"], found[name])
        worst = {"before": 0.0, "after": 0.0}
        for p in answer["parameters"]:
            worst["before"] = max(worst["before"], abs(p["value_without"] - truth[p["name"]]) / p["sigma"])
            worst["after"] = max(worst["after"], abs(p["value"] - truth[p["name"]]) / p["sigma"])
        self.assertLess(worst["after"], 5.0)     # 24 draws beyond 5 sigma: one seed in 70,000
        self.assertGreater(worst["before"], 10.0)

        simulated = unit.folder / "simulated.h5"
        unit.selfcal("simulate", "--config", amended / "sim.toml", "--schedule", amended / "schedule.toml", "--physics",
                     amended / "physics.toml", "--seed", 99, "-o", simulated)
        # The daemon fits the same again and writes it. The gate counts what it does not determine: 20 s dwells leave
        # nothing open in the 24 alone, but the equation takes something of each.
        amended_run = json.loads(unit.selfcal("amend", run["run"], "--json", "--force", "short dwells",
                                              check=False).stdout)
        self.assertEqual((amended_run["kind"], amended_run["amends"]), ("amendment", run["run"]))
        self.assertEqual((amended_run["state"], amended_run["exit_status"]), ("completed", case.DONE),
                         amended_run["reason"])
        self.assertEqual(amended_run["result"]["consistency"]["verdict"], "consistent")
        for objection in amended_run["result"]["objections"]:
            self.assertRegex(objection, "not determined")
        shown = unit.selfcal("show", amended_run["run"]).stdout
        self.assertLess(shown.index("fitted together with the 24"), shown.index("parameter   "), "physics comes first")
        self.assertRegex(shown, r"tau +\S+ \+- \S+ s")
        version, held = witness.coefficients_in_force(unit.interface)
        self.assertGreater(version, 0)
        for p in amended_run["result"]["parameters"]:
            if p["determined"]:
                self.assertLess(abs(held[p["name"]] - truth[p["name"]]), 5.0 * p["sigma"], p)

        # The names may still find a few per cent of a strong effect: a simulation is judged by map, whiteness and size.
        same = json.loads(unit.selfcal("diagnose", run["recording"], "--against", simulated, "--json", check=False).stdout)
        self.assertTrue(same["adequacy"]["before"]["accepted"], same["adequacy"])
        print(f"24 against the truth: {worst['before']:.1f} sigma without, {worst['after']:.1f} with; NIS of recording "
              f"less simulation {same['adequacy']['before']['nis']:.2f}")


if __name__ == "__main__":
    unittest.main()
