"""What the daemon says of a run and of three units, made from an estimate: report_documents.py ESTIMATE.json RECORDING
writes run.json, failed.json (a run that broke off), replaced.json (a run whose set another run replaced) and history-SN-000{1,2,3}.json, in the formats of `selfcal show --json`
and `selfcal history --json`; and investigation.json, a story as `selfcal investigate --json` tells it.

SN-0002's accel_bias_z moves by 9 sigma a year, its limit two years ahead; the other values stand still to the millionth of
their sigma, so that no slope among the 71 others can pass for a drift by chance.
"""
import json
import sys

estimate_file, recording = sys.argv[1:]
estimate = json.load(open(estimate_file))
parameters = estimate["parameters"]


def summary(run, serial, year):
    return {"run": run, "ins": "bench", "serial": serial, "state": "completed", "exit_status": 0, "reason": "",
            "user": "operator", "kind": "calibration", "schedule": "table2", "dry_run": False, "stop_when_met": False,
            "early_end_s": None, "force_reason": "", "started_utc": f"{year}-03-01T08:00:00Z",
            "ended_utc": f"{year}-03-01T09:00:00Z", "software": "1.0", "ins_software": "2.1", "recording": recording,
            "drift_before_m": 425.0, "drift_after_m": 31.0}


def history(serial, slope_sigmas):
    first = 100 * int(serial[-1])
    runs = [summary(first + k, serial, 2021 + k) for k in range(5)]
    entries = []
    for parameter in parameters:
        drifts = slope_sigmas != 0 and parameter["name"] == "accel_bias_z"
        sigma = parameter["sigma"]
        values = [{"run": run["run"], "utc": run["ended_utc"], "sigma": sigma, "determined": True,
                   "value": parameter["value"] + (slope_sigmas * sigma * k if drifts else 1e-6 * sigma * (k % 2))}
                  for k, run in enumerate(runs)]
        entries.append({"name": parameter["name"], "unit": parameter["unit"], "values": values,
                        "limit": abs(values[-1]["value"]) + 18 * sigma if drifts else None, "warnings": []})
    return {"serial": serial, "runs": runs, "parameters": entries}


def coefficients(version, factor):
    return {"version": version, "date_utc": "2026-03-01T09:00:00Z", "author": "operator",
            "parameters": [{"name": p["name"], "unit": p["unit"], "value": factor * p["value"]} for p in parameters]}


histories = [history("SN-0001", 0), history("SN-0002", 9), history("SN-0003", 0)]
for one in histories:
    json.dump(one, open(f"history-{one['serial']}.json", "w"))
json.dump(histories, open("histories.json", "w"))
run = summary(199, "SN-0001", 2026)
new = coefficients(3, 1.0)
run |= {"events": [{"utc": run["started_utc"], "kind": "transition", "text": "connecting to unlocking"}],
        "coefficients": {"previous": coefficients(2, 0.9), "proposed": new, "read_back": new, "pushed": new,
                         "in_force": True},
        "result": estimate}
json.dump(run, open("run.json", "w"))
force = {"now": False, "known": True, "from_utc": run["ended_utc"], "until_utc": "2026-04-01T09:00:00Z", "ended_by_run": 201}
json.dump(run | {"in_force": force, "coefficients": run["coefficients"] | {"in_force": False}}, open("replaced.json", "w"))
none = {"previous": None, "proposed": None, "read_back": None, "pushed": None, "in_force": False}
run |= {"state": "failed", "exit_status": 4, "reason": "the link to the INS is gone", "result": None, "coefficients": none,
        "recording": "gone.h5", "drift_before_m": None, "drift_after_m": None}
json.dump(run, open("failed.json", "w"))

# Two equations that one recording cannot tell apart, a rotation, and the one that is left.
SLOW, FAST = "exp(-since/45.2)*so", "exp(-since/30)*-so**2/(1+abs(fx))"


def law(expression, members, size, sigma):
    return {"axis": "accel_y", "expression": expression, "coefficient": size, "sigma": sigma, "unit": "ug", "constants": {},
            "significance": size / sigma, "held_out_gain": 120.0, "share": 0.97,
            "class": [{"expression": e, "axis": "accel_y", "odds": odds, "also": ["exp(-since/45.2)*abs(so)"] if e == SLOW else []} for e, odds in members]}


def told(verdict, standing, following):
    return {"standing": standing, "verdict": verdict, "cause": "accel_y: NIS 3.1 becomes 1.01.", "next": following}


first = {"runs": [7], "amendment": 8, "summary": told("The model leaves out what no catalogue holds.", "bad", "selfcal amend 7"),
         "discovered": [law(SLOW, [(SLOW, 1.0), (FAST, 0.21)], 24.5, 1.2)], "experiment": 9,
         "next_experiment": {"schedule": {"positions": [[0, 0], [45, 0], [45, 90]], "dwell_s": [60, 60, 120], "rotation_s": 6.0},
                             "splits": [FAST], "separation_sigma": 8.4, "separation_now_sigma": 1.8, "expected_odds": 2.1e15}}
second = {"runs": [7, 9], "amendment": 10, "summary": told("All 24 parameters are determined to tolerance.", "good", "selfcal report 11"),
          "discovered": [law(SLOW, [(SLOW, 1.0)], 24.9, 0.6)], "experiment": None}
json.dump({"schema": {"name": "selfcal.investigation", "version": 1}, "program": {"name": "selfcal", "version": "0"},
           "steps": [first, second], "ended": "one equation is left", "written_by": 11, "exit_status": 0},
          open("investigation.json", "w"))
