#!/usr/bin/env python3
"""Negative control of check.py: in a small tree that keeps the rules it must find nothing, and each breach that is
then put into that tree, alone, must be found, and be the only thing found."""
import tempfile
import unittest
from pathlib import Path

import check

KEPT = {
    "estimator/geometry/rotation.hpp": "#include <array>\n#include <Eigen/Core>\n",
    "estimator/models/imu_data.hpp": '#include "estimator/geometry/rotation.hpp"\n',
    "estimator/navigation/navigator.hpp": '#include "estimator/models/imu_data.hpp"\n',
    "estimator/statistics/distributions.hpp": "",
    "estimator/passes/pass.hpp": '#include "estimator/navigation/navigator.hpp"\nnamespace ins {\nstruct Turn;\nclass Pass::Turn {\n};\n'
                                 'struct Turn {\n};\n}  // namespace ins\n',
    "estimator/diagnosis/search.cpp": '#include "estimator/passes/pass.hpp"\n  std::snprintf(text, 8, "%d", 1);\n'
                                      '  bool same = a.effect == b.effect;  // not a.id == b.id\n  f.id = "walk";\n',
    "protocol/error.hpp": "#include <tl/expected.hpp>\n",
    "protocol/isotp/codec.hpp": '#include <span>\n#include "protocol/error.hpp"\n',
    "protocol/can/socket.cpp": "#include <linux/can.h>\n",
    "protocol/toml_file/toml_text.hpp": "#include <toml++/toml.h>\n",
    "protocol/can/frame.hpp": "#include <cstdint>\n",
    "protocol/flash/page.hpp": '#include "protocol/can/frame.hpp"\n',
    "sim_ins/gimbal.cpp": '#include "estimator/geometry/rotation.hpp"\n#include "protocol/isotp/codec.hpp"\n',
    "daemon/main.cpp": '#include "estimator/passes/pass.hpp"\n#include <systemd/sd-event.h>\n',
    "tools/cli/main.cpp": '#include "daemon/host/config.hpp"\n#include "sim_ins/config.hpp"\n',
    "daemon/host/config.hpp": "namespace host {\nstruct Turn {\n};\n}  // namespace host\nnamespace ins {\nnamespace {\nstruct Turn {\n};\n"
                              "}  // namespace\n}  // namespace ins\n",
    "daemon/ins/ins_client.hpp": '#include "daemon/host/config.hpp"\n',
    "daemon/store/run_store.hpp": '#include "daemon/host/config.hpp"\n',
    "daemon/estimate/estimate_job.hpp": '#include "daemon/store/run_store.hpp"\n',
    "daemon/run/calibration_run.hpp": '#include "daemon/ins/ins_client.hpp"\n#include "daemon/estimate/estimate_job.hpp"\n',
    "sim_ins/config.hpp": "constexpr int other = 0x0201, fill = 0xCC, decimal = 512;\n",
    "config/profiles/selfcal.toml": "[state]\ndid = 0x0200  # not 0x0201\n"
                                    "[rotate]\nroutine = 0x0301\n[bus]\nrequest = 0x640\npadding = 0xCC\n",
    "tests/helper.hpp": "constexpr int state = 0x0200;\n",
} | {f"{folder}/README.md": "" for folder in check.TOP_LEVEL}

BREACHES = {
    "geometry knows nobody": ("estimator/geometry/rotation.hpp", '#include "estimator/models/imu_data.hpp"\n'),
    "models below passes": ("estimator/models/imu_data.hpp", '#include "estimator/passes/pass.hpp"\n'),
    "statistics know no model": ("estimator/statistics/distributions.hpp", '#include "estimator/passes/pass.hpp"\n'),
    "navigation below diagnosis": ("estimator/navigation/navigator.hpp", '#include "estimator/diagnosis/search.cpp"\n'),
    "estimator without protocol": ("estimator/passes/pass.hpp", '#include "protocol/error.hpp"\n'),
    "estimator without files": ("estimator/passes/pass.hpp", "#include <fstream>\n"),
    "estimator without clock": ("estimator/diagnosis/search.cpp", "#  include <chrono>\n"),
    "estimator without threads": ("estimator/geometry/rotation.hpp", "#include <thread>\n"),
    "estimator without words": ("estimator/passes/pass.hpp", '  std::fprintf(stderr, "pass");\n'),
    "effects by their address": ("estimator/diagnosis/search.cpp", "  same = a.effect->id == b.effect->id;\n"),
    "no id spelt out": ("estimator/diagnosis/search.cpp", '  sway = f.effect == "base_sway";\n'),
    "no family by its id": ("estimator/diagnosis/search.cpp", '  gyro = e.id.starts_with("gyro");\n'),
    "codec without system": ("protocol/isotp/codec.hpp", "#include <linux/can.h>\n"),
    "codec without library": ("protocol/isotp/codec.hpp", "#include <nlohmann/json.hpp>\n"),
    "codec without socket": ("protocol/isotp/codec.hpp", '#include "protocol/can/socket.cpp"\n'),
    "flash without uds": ("protocol/flash/page.hpp", '#include "protocol/isotp/codec.hpp"\n'),
    "protocol without estimator": ("protocol/can/socket.cpp", '#include "estimator/models/imu_data.hpp"\n'),
    "protocol without daemon": ("protocol/can/socket.cpp", '#include "daemon/host/config.hpp"\n'),
    "virtual INS without estimator": ("sim_ins/gimbal.cpp", '#include "estimator/models/imu_data.hpp"\n'),
    "virtual INS without daemon": ("sim_ins/gimbal.cpp", '#include "daemon/host/config.hpp"\n'),
    "daemon without virtual INS": ("daemon/main.cpp", '#include "sim_ins/config.hpp"\n'),
    "daemon without tools": ("daemon/main.cpp", '#include "tools/cli/main.cpp"\n'),
    "host knows no other room": ("daemon/host/config.hpp", '#include "daemon/store/run_store.hpp"\n'),
    "ins without store": ("daemon/ins/ins_client.hpp", '#include "daemon/store/run_store.hpp"\n'),
    "store without ins": ("daemon/store/run_store.hpp", '#include "daemon/ins/ins_client.hpp"\n'),
    "store below run": ("daemon/store/run_store.hpp", '#include "daemon/run/calibration_run.hpp"\n'),
    "estimate without ins": ("daemon/estimate/estimate_job.hpp", '#include "daemon/ins/ins_client.hpp"\n'),
    "estimate below run": ("daemon/estimate/estimate_job.hpp", '#include "daemon/run/calibration_run.hpp"\n'),
    "run below the service": ("daemon/run/calibration_run.hpp", '#include "daemon/main.cpp"\n'),
    "toml++ behind its guard": ("daemon/main.cpp", "#include <toml++/toml.h>\n"),
    "no data identifier of ours": ("daemon/main.cpp", "constexpr int state = 0x200;\n"),
    "no routine of ours": ("sim_ins/config.hpp", "constexpr auto rotate = 0x0301U;\n"),
    "no frame of ours": ("tools/cli/main.cpp", "constexpr int request = 0X640;\n"),
    "nobody includes tests": ("tools/cli/main.cpp", '#include "tests/helper.hpp"\n'),
    "paths from the root": ("daemon/main.cpp", '#include "config.hpp"\n'),
    "one name, two types": ("tools/cli/main.cpp", "namespace ins {\nclass Turn final : public Move {\n};\n}  // namespace ins\n"),
    "long file": ("daemon/main.cpp", "\n" * (check.LINE_LIMIT + 1)),
    "folder without README": ("config/README.md", None),
}


def write(root, files):
    for name, content in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")


class CheckFinds(unittest.TestCase):
    def test_nothing_where_the_rules_are_kept(self):
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder), KEPT)
            self.assertEqual(list(check.complaints(Path(folder))), [])

    def test_each_breach(self):
        for name, (path, content) in BREACHES.items():
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                write(Path(folder), KEPT)
                if content is None:
                    (Path(folder) / path).unlink()
                else:
                    with open(Path(folder) / path, "a", encoding="utf-8") as file:
                        file.write(content)
                found = list(check.complaints(Path(folder)))
                self.assertEqual(len(found), 1, found)
                self.assertTrue(found[0].startswith(path.removesuffix("README.md")), found)


if __name__ == "__main__":
    unittest.main()
