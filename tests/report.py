#!/usr/bin/env python3
"""Tests tools/report as users run it, on made-up runs: tables, comparisons, plots, and what it refuses."""

import csv
import io
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

REPORT = Path(__file__).resolve().parent.parent / "tools" / "report"
ENVIRONMENT = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}


def times(ms: float, samples: int = 21) -> dict:
    """Timing statistics whose samples lie within 1 % of their median."""
    return {"median": ms, "p10": ms * 0.992, "p90": ms * 1.008,
            "samples": [ms * (1 + 0.01 * (2 * (i * 7 % samples) / max(1, samples - 1) - 1)) for i in range(samples)]}


def record(label: str = "packet(any)", ms: float = 1, **fields) -> dict:
    knobs = {"vote": "any"} if label == "packet(any)" else {}
    made = {"scene": "sponza", "view": "view0", "rays": "primary", "any": False, "label": label, "role": "method",
            "method": label.partition("(")[0], "knobs": knobs, "numeric": "watertight", "variant": label,
            "subgroup": 32, "ray_count": 1000000, "trace_ms": times(ms)}
    made.update(fields)
    if made["role"] != "sweep":
        made["frame_ms"] = times(ms + 1)
    return made


def run(*records: dict, **fields) -> dict:
    return {"kind": "methods", "device": "Imagined GPU", "driver": "imagined 1.0", "cpu": False, "subgroup_size": 32,
            "commit": "0123456789ab", "command": "ballot bench sponza.glb", "clock": "GPU timestamps",
            "size": [1024, 1024], "repeats": 21, "scenes": [], "records": list(records), **fields}


def paper_run(**fields) -> dict:
    """Two views, primary and shadow rays: packet with three votes, if-if, a sweep of cut and the best of it."""
    records = []
    for rays in ("primary", "shadow"):
        for view in ("view0", "view1"):
            for label, ms, role, knobs in (("packet(any)", 1, "method", {"vote": "any"}),
                                           ("packet(count)", 0.8, "method", {"vote": "count"}),
                                           ("packet(sum)", 2, "method", {"vote": "sum"}), ("if-if", 1.25, "method", {}),
                                           ("cut(0.25)", 1.5, "sweep", {"f": "0.25", "vote": "count"}),
                                           ("cut(0.5)", 0.5, "sweep", {"f": "0.5", "vote": "count"}),
                                           ("cut(best)", 0.5, "best", {"f": "0.5", "vote": "count"})):
                made = record(label, ms, rays=rays, view=view, any=rays == "shadow", role=role, knobs=knobs)
                if "f" in knobs:
                    made["threshold"] = {"knob": "f", "value": float(knobs["f"])}
                records.append(made)
    scene = {"name": "sponza", "triangles": 76154, "references": 114231, "nodes": 52001, "depth": 25, "sah": 60.5,
             "bytes": 2000000}
    return run(*records, scenes=[scene], **fields)


def verified(numeric: str, **counts) -> dict:
    zero = dict.fromkeys(("false_misses", "false_hits", "wrong_prims", "ties", "wrong_values", "within_bound",
                          "beyond_bound", "unwritten", "self_hits", "beyond_range"), 0)
    return record("while-while", 1 if numeric == "fast" else 1.25, numeric=numeric, verified_rays=1000000,
                  t_ulp={"median": 0.5, "p99": 3, "max": None}, cases=[]) | zero | counts


class Report(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def report(self, *words, code: int = 0, python: str = sys.executable) -> str:
        """Runs the program in the folder. Returns what it printed, of failures the message."""
        done = subprocess.run([python, REPORT, *words], cwd=self.folder, capture_output=True, text=True, check=False,
                              env=ENVIRONMENT)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        return done.stdout or done.stderr

    def write(self, name: str, content) -> str:
        text = content if isinstance(content, str) else json.dumps(content)
        (self.folder / name).write_text(text, encoding="utf-8")
        return name

    def tables(self, *documents: dict) -> str:
        return self.report("tables", *(self.write(f"{i}.json", d) for i, d in enumerate(documents)))

    def row(self, text: str, heading: str, *first: str) -> list[str]:
        """Returns the cells of the first row below a heading that begins so."""
        self.assertIn(heading, text)
        for line in text[text.index(heading):].splitlines()[1:]:
            cells = [cell.strip() for cell in line.split("|")[1:-1]]
            if cells[:len(first)] == list(first):
                return cells[len(first):]
        self.fail(f"no row {first} below {heading} in:\n{text}")
        return []


class Tables(Report):
    def test_speeds_stand_beside_the_published_figures(self):
        text = self.tables(paper_run(environment={"VK_DRIVER_FILES": "/tmp/my icd.json"}))
        self.assertIn("VK_DRIVER_FILES='/tmp/my icd.json' ballot bench sponza.glb\n", text)
        self.assertEqual(self.row(text, "## Table 1", "Sponza"),
                         ["76k", "76154", "114k", "114231", "52k", "52001", "25", "60.5", "1.9"])
        self.assertEqual(self.row(text, "## Table 2", "packet"), ["47.46 (0%)", "500.0 (+0.0 %)"])
        self.assertEqual(self.row(text, "## Table 2", "if-if"), ["47.80 (+0.72%)", "444.4 (-11.1 %)"])
        self.assertEqual(self.row(text, "## Table 2", "stack-max(11)"), ["47.40 (-0.13%)", "-"])
        self.assertEqual(self.row(text, "Mrays/s (over the best), primary", "packet(count)"), ["1250 (1.60)"])
        self.assertEqual(self.row(text, "Mrays/s (over the best), primary", "cut(best)"), ["2000 (**1.00**)"])
        self.assertEqual(self.row(text, "frames/s, primary", "packet(sum)"), ["333.3"])
        self.assertEqual(self.row(text, "time over the best method's", "if-if"),
                         ["2.50", "sponza, primary", "2.500", "2.500", "2"])
        self.assertEqual(self.row(text, "speed by vote", "packet", "primary")[0], "1.250 (1.25 to 1.25)")
        self.assertEqual(self.row(text, "Mrays/s by f: cut, vote=count", "0.5", "primary"), ["2000"])

    def test_what_stands_in_for_a_row_of_the_paper_is_named(self):
        other = run(record(), record("cut", 3), device="Imagined CPU")
        text = self.tables(run(record(), record("cut(sum)", 9)), other)
        self.assertEqual(self.row(text, "## Table 2", "cut"),
                         ["42.28 (-10.91%)", "100.0 (-80.0 %)", "250.0 (-50.0 %), cut"])
        self.assertIn("Sponza, Imagined CPU, watertight", text)

    def test_auto_is_held_to_the_best_of_the_others(self):
        text = self.tables(run(record("auto", 1.1, runs="if-if"), record("if-if", 1), record("bvh4", 2)))
        self.assertEqual(self.row(text, "time over the best method's", "auto")[0], "1.10")
        self.assertEqual(self.row(text, "Mrays/s (over the best)", "auto"), ["909.1 (1.10, if-if)"])
        text = self.tables(run(record("auto", 0.9), record("if-if", 1)))
        self.assertEqual(self.row(text, "time over the best method's", "auto")[0], "0.90")
        self.assertEqual(self.row(text, "time over the best method's", "if-if")[0], "1.00")

    def test_entries_that_lack_views_are_not_the_best(self):
        both = [record(ms=ms, label=label, view=view) for label, ms in (("packet(any)", 1), ("if-if", 2))
                for view in ("view0", "view1")]
        text = self.tables(run(*both, record("bvh4", 0.1), partial=True))
        self.assertIn("The run was interrupted", text)
        self.assertEqual(self.row(text, "Mrays/s (over the best)", "bvh4"), ["10000 (lacks views)"])
        self.assertEqual(self.row(text, "Mrays/s (over the best)", "if-if"), ["500.0 (2.00)"])

    def test_the_later_of_two_measurements_counts(self):
        text = self.tables(run(record(ms=2)), run(record(ms=1)))
        self.assertEqual(self.row(text, "Mrays/s", "packet(any)"), ["1000 (**1.00**)"])

    def test_counters_are_pooled_and_checks_summed(self):
        counters = ({"nodes": 64, "nodes_needed": 30, "leaves_needed": 2, "steps": 2, "packet_nodes": 64,
                     "stack_max": 7, "active_share": 0.5, "packet_share": 1},
                    {"nodes": 32, "nodes_needed": 7, "leaves_needed": 1, "steps": 1, "packet_nodes": 0,
                     "stack_max": 5, "active_share": 0.25, "packet_share": 0})
        check = {"rays": 1000, "same": 990, "tie": 7, "false_misses": 2, "false_hits": 0, "wrong_prims": 1,
                 "wrong_t": 0, "unwritten": 0}
        text = self.tables(run(record(counters=counters[0], check=check),
                               record(counters=counters[1], view="view1", ray_count=3000000)))
        names = self.row(text, "## Speed", "counters, means a ray")
        values = dict(zip(names, self.row(text, "counters, means", "sponza")))
        self.assertEqual(values["nodes"], "40.00")  # (64 + 3 * 32) / 4
        self.assertEqual(values["active_share"], "0.3500")  # (32 + 3 * 8) / (32 * (2 + 3 * 1))
        self.assertEqual(values["packet_share"], "0.4000")  # 64 / (64 + 3 * 32)
        self.assertEqual(values["stack_max"], "7.000")
        self.assertIn("1000 hits held to the CPU oracle, 3 errors", text)

    def test_names_from_files_break_neither_csv_nor_tables(self):
        name = self.write("a.json", run(record(scene="a|b\nc\x1b[31m"), device='GPU, the "best"'))
        self.assertIn("a\\|b c [31m", self.report("tables", name))
        rows = list(csv.DictReader(io.StringIO(self.report("tables", name, "--csv"), newline="")))
        self.assertEqual((rows[0]["device"], rows[0]["scene"]), ('GPU, the "best"', "a|b\nc\x1b[31m"))
        self.assertEqual((rows[0]["trace_ms.median"], rows[0]["knobs"]), ("1", "vote=any"))

    def test_merged_runs_are_those_of_the_files(self):
        names = self.write("a.json", paper_run()), self.write("b.json", paper_run(device="Imagined CPU"))
        apart = self.report("tables", *names)
        self.assertEqual(self.report("tables", self.write("c.json", self.report("merge", *names))), apart)
        self.assertIn("## Speed: Imagined CPU, watertight", apart)

    def test_modes_cost_and_err(self):
        hard = [{"case": "needles", "from": "Embree", "rays": "r", "any": False, "numeric": mode, "label": "if-if",
                 "knobs": {}, "leaks": 2, "unlike_known": 0, "differing": 0,
                 **{k: 0 for k in ("false_misses", "false_hits", "wrong_prims", "ties", "wrong_values", "beyond_bound",
                                   "unwritten", "self_hits")}} for mode in ("fast", "watertight")]
        wrong = {"index": 5, "kind": "false miss", "within_bound": False, "reason": "it hits", "ray": [0] * 8,
                 "answer": {}, "truth": {}}
        text = self.tables(run(verified("fast", false_misses=12, wrong_prims=8, beyond_bound=3, cases=[wrong]),
                               verified("watertight"), hard=hard))
        self.assertEqual(self.row(text, "What a numeric mode costs", "watertight")[1], "+25.0 %")
        self.assertEqual(self.row(text, "What a numeric mode costs", "fast")[3:6], ["1000000", "20.0", "3.0"])
        self.assertEqual(self.row(text, "wrong per million: the worst", "sponza", "primary"), ["20.0 (3.0)", "0"])
        self.assertEqual(self.row(text, "## Hard cases", "needles", "Embree"), ["2 leaks", "**2 leaks**"])
        self.assertEqual(self.row(text, "## Speed against error", "sponza", "primary", "while-while", "fast")[0],
                         "1000")
        self.assertIn("false miss, **beyond the bound**: it hits. Ray 5", text)

    def test_a_better_tree_pays_from_a_number_of_rays(self):
        def builder(name: str, seconds: float, mrays: float) -> dict:
            return {"scene": "s", "triangles": 1000, "builder": name, "build_s": [seconds], "peak_mib": None,
                    "nodes": 9, "sah": 3.5, "mrays_per_s": {"ao": mrays}}
        made = {"kind": "builders", "device": "d", "records": [builder("fast", 1, 1), builder("best", 3, 2),
                                                               builder("worst", 4, 1)]}
        text = self.tables(made)
        self.assertEqual(self.row(text, "## Builders", "best")[-2:], ["2.000", "4e+06"])
        self.assertEqual(self.row(text, "## Builders", "worst")[-1], "never")
        frames = {"kind": "frames", "device": "d", "records": [{"update": "refit", "frame": 3, "pose_ms": 0.5}]}
        self.assertEqual(self.row(self.tables(frames), "## Frames", "refit"), ["3", "0.5000"])

    def test_what_no_command_wrote_is_refused(self):
        broken = run(record(), record())
        broken["records"][1]["trace_ms"] = 3
        zero, unnamed = run(record(ms=1)), run(record())
        zero["records"][0]["trace_ms"]["median"] = 0
        del unnamed["records"][0]["label"]
        for content, said in (("", "a.json: expected JSON"), ("[" * 100000, "a.json: expected JSON"),
                              ([1, 2], "a.json: top level: expected an object, found [1, 2]"),
                              ({}, "top level: expected an object with 'records'"),
                              (broken, "records[1].trace_ms: expected a value of type dict, found 3"),
                              (zero, "records[0].trace_ms.median: expected a number above 0, found 0"),
                              (unnamed, "records[0]: expected an object with 'label'"),
                              (run(kind="poems"), "kind: expected one of methods, builders")):
            self.assertIn(said, self.report("tables", self.write("a.json", content), code=1))
        self.assertIn("b.json: No such file", self.report("tables", "b.json", code=1))
        self.report("tables", code=2)


class Compare(Report):
    def compare(self, a, b, *words, code: int = 0) -> str:
        """Compares runs, or those with one record a view of these times."""
        a, b = (d if isinstance(d, dict) else run(*(record(ms=ms, view=f"view{i}") for i, ms in enumerate(d)))
                for d in (a, b))
        return self.report("compare", self.write("a.json", a), self.write("b.json", b), *words, code=code)

    def test_equal_and_faster_runs_pass_and_slower_ones_do_not(self):
        text = self.compare([1, 2], [1, 2])
        self.assertIn("\nfaster by more than 2 %: none", text)
        self.assertIn("\nslower by more than 2 %: none", text)
        text = self.compare([1, 2], [1.1, 2.2], code=1)
        self.assertIn("\nslower by more than 2 %: 1\n  sponza, primary, watertight, packet(any) 1.100", text)
        self.assertIn("single views slower by more than 2 %: 2", text)
        self.assertIn("geometric mean of all 1: 0.800", self.compare([1, 2], [0.8, 1.6]))
        self.compare([1], [1.1], "--tolerance", "0.2")
        self.compare([1], [1.03], "--tolerance", "0", code=1)
        self.assertIn("--tolerance: -1.0", self.compare([1], [1], "--tolerance", "-1", code=1))

    def test_single_views_do_not_decide(self):
        text = self.compare([1, 1, 1, 1, 1], [1, 1, 1, 1, 1.08])
        self.assertIn("single views slower by more than 2 %: 1\n  sponza, view4,", text)
        self.assertIn("only in A: 1\n", self.compare([1, 2, 3], [1, 2]))

    def test_noise_is_no_regression(self):
        noisy = run(record(ms=1.4))
        noisy["records"][0]["trace_ms"]["samples"] = [0.8 if i % 2 else 1.4 for i in range(21)]
        self.assertIn("1.400", self.compare([1], noisy))
        self.assertEqual(self.compare([1, 2], [1.01, 2.03]), self.compare([1, 2], [1.01, 2.03]))

    def test_intervals_are_those_of_medians(self):
        """The interval by the bootstrap's quantiles, which 21 samples of a known spread give."""
        data = json.loads(self.compare([1], [1], "--json"))
        self.assertAlmostEqual(data["confidence"], 0.95)
        self.assertTrue(0.985 < data["groups"][0]["low"] < 0.996, data)
        self.assertAlmostEqual(data["groups"][0]["low"] * data["groups"][0]["high"], 1, delta=0.002)

    def test_intervals_widen_with_the_number_of_verdicts(self):
        many = run(*(record(f"cut({i})") for i in range(100)))
        many, one = (json.loads(self.compare(d, d, "--json")) for d in (many, run(record())))
        self.assertAlmostEqual(many["confidence"], 0.9995)
        width = [d["groups"][0]["high"] - d["groups"][0]["low"] for d in (many, one)]
        self.assertGreater(width[0], 1.3 * width[1])

    def test_like_settings_are_compared(self):
        def both(cpu_ms: float) -> dict:
            cpu = run(record(ms=cpu_ms), device="llvmpipe", cpu=True)
            return {"documents": [run(record(ms=1)), cpu]}
        self.assertIn("up to 40 % between two compiles", self.compare(both(40), both(40)))
        self.assertIn("llvmpipe, imagined 1.0", self.compare(both(40), both(80), code=1))
        other = run(record(), device="Another GPU", ao_rays=4, partial=True)
        text = self.compare([1], other)
        for said in ("warning: device differs: Imagined GPU and Another GPU", "warning: ao_rays differs: 8 and 4",
                     "warning: B (b.json, Another GPU) is partial"):
            self.assertIn(said, text)
        self.assertIn("have no record in common: found 2 and 1", self.compare(both(1), other, code=1))
        self.assertIn("have no record in common", self.compare([1], run(record("if-if")), code=1))
        self.assertIn("b.json: found a run of frames", self.compare([1], {"kind": "frames", "records": []}, code=1))

    def test_times_are_per_ray_and_sweeps_are_left_out(self):
        self.compare(run(record(ms=1)), run(record(ms=2, ray_count=2000000)))
        swept = paper_run()
        for made in swept["records"]:
            if made["role"] == "sweep":
                made["trace_ms"] = times(99)
        self.compare(paper_run(), swept)

    def test_few_samples_are_not_judged(self):
        for samples in (0, 1, 5, 6):
            few = run(record(trace_ms=times(2, samples)))
            text = self.compare([1], few, code=int(samples == 6))
            self.assertIn("2.000", text)
            self.assertEqual("1 have too few samples" in text, samples < 6)


class Plots(Report):
    def test_each_kind_is_drawn(self):
        python = next((p for p in (sys.executable, "/usr/bin/python3") if subprocess.run(
            [p, "-c", "import matplotlib"], capture_output=True, check=False).returncode == 0), None)
        if python is None and not os.environ.get("CI"):
            self.skipTest("matplotlib is missing")
        made = paper_run()
        for r in made["records"]:
            r["counters"] = {"nodes": 40, "nodes_needed": 30}
        self.write("a.json", made)
        self.write("b.json", run(verified("fast", false_misses=9), verified("exact"), device="Imagined $CPU"))
        self.write("c.json", {"kind": "builders", "device": "d", "driver": "e", "records": [
            {"scene": "s", "triangles": n, "builder": "fast", "build_s": [n * 1e-6], "peak_mib": 3,
             "mrays_per_s": {"ao": 2}} for n in (100, 1000)]})
        self.write("d.json", {"kind": "origins", "records": [
            {"policy": "ulp", "scene_size": size, "distance": at, "rays": 9, "self_hits": 1, "lost_contacts": 0}
            for size in (1, 10) for at in (0, 5)]})
        self.write("e.errors.json", {"kind": "errors", "picture": "e.exr", "records": [
            {"seconds": s, "rmse": 1 / s, "relmse": 2 / s, "flip": 0.5 / s} for s in (1, 2, 4)]})
        subprocess.run([python, "-c", "import numpy as n; a = n.arange(-13.0, 14).reshape(3, 3, 3);"
                        "n.save('f', a); a.astype('<f4').tofile('g.raw')"], cwd=self.folder, check=True)
        names = ("a.json", "b.json", "c.json", "d.json", "e.errors.json", "f.npy", "g.raw")
        written = self.report("plots", *names, "--out", "out", python=python).split()
        self.assertEqual(set(written), {
            "speedup-1-watertight.svg", "threshold-1-watertight-f.svg", "coherence-1-watertight.svg", "accuracy-2.svg",
            "c.svg", "c-s.svg", "d.svg", "e.errors.svg", "f.svg", "g.svg"})
        self.assertEqual({p.name for p in (self.folder / "out").iterdir()},
                         {p for name in written for p in (name, name.replace(".svg", ".png"))})

    def test_without_matplotlib_it_says_what_to_install(self):
        self.write("matplotlib.py", "raise ImportError('No module named matplotlib')\n")
        self.write("a.json", paper_run())
        ENVIRONMENT["PYTHONPATH"] = str(self.folder)
        self.addCleanup(ENVIRONMENT.pop, "PYTHONPATH")
        self.assertIn("install python3-matplotlib", self.report("plots", "a.json", "--out", "out", code=1))


if __name__ == "__main__":
    unittest.main()
