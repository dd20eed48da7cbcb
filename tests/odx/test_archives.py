"""The PDX of each profile: whole, every reference leads somewhere, and the messages of ISO 14229-1 are those of its services.
usage: test_archives.py SELFCAL"""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import read_pdx

ROOT = Path(__file__).resolve().parents[2]
SELFCAL = sys.argv.pop()
UPLOAD = '[upload]\naddress = "byte"\naddress_bytes = 3\nsize_bytes = 3\n'


class Archives(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="selfcal_odx.")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def odx(self, profile, output="made.pdx"):
        return subprocess.run([SELFCAL, "device", "odx", profile, "-o", self.folder / output], capture_output=True, text=True, check=False)

    def read(self, profile):
        done = self.odx(profile)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        pdx = read_pdx.Pdx(self.folder / "made.pdx")
        print(f"{profile.name}: {len(pdx.services)} services, {pdx.references} references, each leads somewhere", flush=True)
        return pdx, done.stdout

    def test_every_reference_leads_somewhere(self):
        for name in ("selfcal", "example", "memory", "moves", "addresses"):
            with self.subTest(name):
                self.read(ROOT / "config" / "profiles" / f"{name}.toml")

    def test_messages(self):
        pdx, lost = self.read(ROOT / "config" / "profiles" / "example.toml")
        # Site of example.toml: 40 deg N, 116 deg E in 1e-7 deg, 50 m in cm, lowest byte first.
        name, values = pdx.decode_response(bytes.fromhex("62fd12 0084d717 00322445 88130000"), bytes.fromhex("22fd12"))
        self.assertEqual(name, "read_site")
        for field, expected in (("latitude", 0.6981317007977318), ("longitude", 2.0245819323134224), ("height", 50.0)):
            self.assertAlmostEqual(values["record"][field], expected, delta=1e-12 * expected)
        # State: bits 0 to 3 the state, 4 and 5 the slot, 8 to 15 the faults.
        _, values = pdx.decode_response(bytes.fromhex("62fd10 1203 0500 07000000 09000000"), bytes.fromhex("22fd10"))
        self.assertEqual(values["record"], {"state": "rotating", "in_force": "b", "faults": 3, "coefficients_version": 5,
                                            "run_id": 7, "power_cycles": 9})
        name, values = pdx.decode_response(bytes.fromhex("7f2231"), bytes.fromhex("22fd10"))
        self.assertEqual((name, values["code"]), ("read_state", "requestOutOfRange"))
        with self.assertRaises(read_pdx.Other):
            pdx.decode_response(bytes.fromhex("62fd10 1203 0500 07000000 090000"), bytes.fromhex("22fd10"))
        for words in ("AES-CMAC", "crc32 of bytes 0 to 199", "y -x z, gimbal outer -inner", "255 repetitions", "page"):
            self.assertIn(words, lost)

    def test_records_in_memory(self):
        pdx, lost = self.read(ROOT / "config" / "profiles" / "addresses.toml")
        asked = bytes.fromhex("23 13 040100 0c")
        self.assertEqual(pdx.decode_request(asked)[0], "read_state")
        # 0x201 complete, no faults, version 3, run 7, power-on 9.
        name, values = pdx.decode_response(bytes.fromhex("63 0201 00 03 00000007 00000009"), asked)
        self.assertEqual(name, "read_state")
        self.assertEqual(values["record"], {"state": "complete", "faults": 0, "coefficients_version": 3, "run_id": 7, "power_cycles": 9})
        for other in ("23 13 040101 0c", "23 13 040100 0b", "23 14 040100 0c"):
            with self.assertRaises(read_pdx.Other):
                pdx.decode_request(bytes.fromhex(other))
        self.assertIn("coefficients.in_force: how it is read in parts, by ReadMemoryByAddress", lost)
        self.assertIn("schedule: how it is read in parts, by ReadMemoryByAddress", lost)
        self.assertFalse([name for name in pdx.services if "coefficients" in name or "schedule" in name])
        # Where they are told and taken at once they are services.
        whole = self.folder / "whole.toml"
        text = (ROOT / "config" / "profiles" / "addresses.toml").read_text(encoding="utf-8")
        whole.write_text(text.replace("size_bytes = 1\nlongest = 64\nlongest_write = 48", "size_bytes = 2\nlongest = 512"), encoding="utf-8")
        pdx, lost = self.read(whole)
        self.assertNotIn("in parts", lost)
        name, values = pdx.decode_request(bytes.fromhex("3d 23 048000 00cc 00000005") + bytes(200))
        self.assertEqual((name, values["record"]["version"]), ("write_coefficients_in_force", 5))
        self.assertEqual(pdx.decode_response(bytes.fromhex("7d 23 048000 00cc"), bytes.fromhex("3d 23 048000 00cc") + bytes(204))[0],
                         "write_coefficients_in_force")

    def test_addresses_and_times(self):
        pdx, _ = self.read(ROOT / "config" / "profiles" / "example.toml")
        told = {ref.get("ID-REF").split(".")[1]: [v.text for v in ref.iter("SIMPLE-VALUE")] for ref in pdx.layer.iter("COMPARAM-REF")}
        table = told["CP_UniqueRespIdTable"]
        self.assertEqual((table[0], table[1], table[4]), ("normal segmented 29-bit transmit with FC", str(0x18DA2AF1), str(0x18DAF12A)))
        self.assertEqual(told["CP_CanFuncReqId"], [str(0x18DB33F1)])
        self.assertEqual(told["CP_P2Max"], ["1500000"])

    def test_raw_data_as_files(self):
        profile = self.folder / "files.toml"
        text = (ROOT / "config" / "profiles" / "example.toml").read_text(encoding="utf-8")
        profile.write_text(text.replace(UPLOAD, '[file]\nname = "/raw/{page}"\n'), encoding="utf-8")
        pdx, _ = self.read(profile)
        name, values = pdx.decode_request(b"\x38\x04\x00\x06/raw/7\x00")
        self.assertEqual((name, values["name"]), ("raw_data_begin", "/raw/7"))
        _, values = pdx.decode_response(bytes.fromhex("78 04 04 00000fff 00 0004 00000400 00000400"), b"\x38\x04\x00\x06/raw/7\x00")
        self.assertEqual((values["longest_block"], values["size"]), (4095, 1024))

    def test_what_cannot_be_is_one_line(self):
        for profile, output, words in ((ROOT / "config" / "profiles" / "frames.toml", "f.pdx", "speaks no UDS"),
                                       (ROOT / "config" / "profiles" / "selfcal.toml", "f.zip", ".pdx"),
                                       (ROOT / "config" / "profiles" / "selfcal.toml", "none/f.pdx", "none"),
                                       (self.folder / "none.toml", "f.pdx", "none.toml")):
            done = self.odx(profile, output)
            self.assertIn(done.returncode, (2, 3))
            self.assertEqual((done.stdout, len(done.stderr.splitlines())), ("", 1), done.stderr)
            self.assertIn(words, done.stderr)

    def test_the_reader_refuses_what_is_broken(self):
        """The control: a reference that leads nowhere, an ID that stands twice."""
        import zipfile
        self.read(ROOT / "config" / "profiles" / "selfcal.toml")
        with zipfile.ZipFile(self.folder / "made.pdx") as archive:
            files = {name: archive.read(name) for name in archive.namelist()}
        for was, now in ((b'ID="STRUCT.site"', b'ID="STRUCT.sites"'), (b'ID="STRUCT.site"', b'ID="STRUCT.state"'),
                         (b'ID-REF="REFUSAL"', b'ID-REF="PROTOCOL"'), (b'DOCREF="ISO_15765_3"', b'DOCREF="ISO_15765_2"')):
            with zipfile.ZipFile(self.folder / "broken.pdx", "w") as archive:
                for name, content in files.items():
                    archive.writestr(name, content.replace(was, now, 1) if name == "selfcal.odx-d" else content)
            with self.assertRaises(read_pdx.Broken):
                read_pdx.Pdx(self.folder / "broken.pdx")


if __name__ == "__main__":
    unittest.main()
