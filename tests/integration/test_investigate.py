"""The experimenter on vcan: a law that no catalogue holds is concealed in the virtual INS, the run is refused, and selfcal
investigate turns the INS again until one equation is left, writes the 24 that follow and proves them."""
import json
import unittest

import case
import witness

# On a level base with positions at right angles a component of gravity and a function of the gimbal angles are one.
LAW = {"axis": "accel_y", "expression": "fz*sin(inner)", "coefficient": 55.0}
# Acts in a few turns only, where rates of the axes, senses and the time are nearly one: none of some twenty equations holds elsewhere more
# probably than not.
UNSURE = {"axis": "gyro_z", "expression": "wo*si", "coefficient": 0.1}


class Investigate(case.OnBench):
    def concealing(self, law):
        """A bench whose INS has this law, and its run."""
        unit = self.bench(speed=200.0, ins={"dwell_s": 45.0})
        concealed = unit.folder / "concealed.toml"
        concealed.write_text(f"""[[law]]
axis = "{law['axis']}"
expression = "{law['expression']}"
coefficient = {law['coefficient']}
unit = "{'ug' if law['axis'].startswith('accel') else 'deg/h'}"
""", encoding="ascii")
        unit.sim_options += ["--physics", str(concealed)]
        unit.start()
        return unit, unit.wait_for_end(unit.start_run("--schedule", "horizontal"))

    def test_a_law_that_is_only_described_is_settled_by_another_rotation(self):
        unit, run = self.concealing(UNSURE)
        self.assertEqual(run["exit_status"], case.ANSWER_IS_NO, run["reason"])
        story = json.loads(unit.selfcal("investigate", run["run"], "--time", "110m", "--json", check=False, timeout=800).stdout)
        self.assertEqual(story["exit_status"], case.DONE, story["ended"])
        first, last = story["steps"][0], story["steps"][-1]
        self.assertEqual(first["discovered"], [])
        self.assertEqual([(law["axis"], law["unsure"]) for law in first["unsure"]], [(UNSURE["axis"], True)])
        self.assertIsNotNone(first["experiment"])
        self.assertEqual([(law["axis"], law["expression"]) for law in last["discovered"]], [(UNSURE["axis"], UNSURE["expression"])])
        self.assertAlmostEqual(last["discovered"][0]["coefficient"], UNSURE["coefficient"], delta=5.0 * last["discovered"][0]["sigma"])
        self.assertEqual(unit.document(story["written_by"])["result"]["consistency"]["verdict"], "consistent")
        print(f"{len(first['unsure'][0]['class'])} equations, none sure, then {len(last['discovered'][0]['class'])}; ended: {story['ended']}")

    def test_a_concealed_law_is_settled_by_another_rotation(self):
        unit, run = self.concealing(LAW)
        self.assertEqual(run["exit_status"], case.ANSWER_IS_NO, run["reason"])
        self.assert_old_coefficients(unit)
        truth = unit.truth()

        # No time for a rotation: nothing is turned, nothing is written, and it says why.
        none = json.loads(unit.selfcal("investigate", run["run"], "--time", "1m", "--json", check=False).stdout)
        self.assertEqual((none["exit_status"], none["written_by"]), (case.ANSWER_IS_NO, None))
        self.assertRegex(none["ended"], "the next rotation takes [0-9]+ min, 1 min are left")
        self.assert_old_coefficients(unit)
        self.assert_one_line(unit.selfcal("investigate", run["run"], "--time", "soon", check=False).stderr, "--time soon")
        self.assert_one_line(unit.selfcal("investigate", 99, check=False).stderr, "no run 99")

        story = json.loads(unit.selfcal("investigate", run["run"], "--time", "110m", "--json", check=False, timeout=800).stdout)
        self.assertEqual(story["exit_status"], case.DONE, story["ended"])
        self.assertGreaterEqual(len(story["steps"]), 2)
        experiment = story["steps"][0]["experiment"]
        self.assertEqual(story["steps"][1]["runs"], [run["run"], experiment])
        turned = unit.document(experiment)
        self.assertTrue(turned["dry_run"])
        self.assertNotEqual(turned["schedule"], "horizontal")

        first, last = story["steps"][0]["discovered"], story["steps"][-1]["discovered"]
        members = [len(law["class"]) for law in first], [len(law["class"]) for law in last]
        self.assertEqual(len(last), 1, last)
        self.assertLessEqual(sum(members[1]), sum(members[0]))
        told = [(m["axis"], "*".join(sorted(text.split("*")))) for m in last[0]["class"] for text in [m["expression"], *m["also"]]]
        self.assertIn((LAW["axis"], "*".join(sorted(LAW["expression"].split("*")))), told)

        written = unit.document(story["written_by"])
        self.assertEqual((written["state"], written["kind"], written["amends_with"]),
                         ("completed", "amendment", [r for r in story["steps"][-1]["runs"] if r != written["amends"]]))
        self.assertEqual(written["result"]["consistency"]["verdict"], "consistent")
        version, held = witness.coefficients_in_force(unit.interface)
        self.assertGreater(version, 0)
        worst = 0.0
        for p in written["result"]["parameters"]:
            self.assertTrue(p["determined"], p)
            worst = max(worst, abs(held[p["name"]] - truth[p["name"]]) / p["sigma"])
        self.assertLess(worst, 5.0)   # 24 draws beyond 5 sigma: one seed in 70,000

        # Recordings of the same run twice, or of no rotation, are no second witness.
        self.assert_one_line(unit.selfcal("amend", run["run"], "--with", run["run"], check=False).stderr, "given twice")
        self.assert_one_line(unit.selfcal("amend", run["run"], "--with", "x", check=False).stderr, "--with x")
        print(f"classes of {members[0]} equations, then {members[1]}; 24 against the truth: {worst:.1f} sigma; "
              f"ended: {story['ended']}")


if __name__ == "__main__":
    unittest.main()
