# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A whole frame against POV-Ray 3.7: CPU seconds of the trace, one thread, the same triangles, lights and rays.

    python benchmarks/frame_vs_povray.py                                # 10 thousand triangles
    python benchmarks/frame_vs_povray.py --triangles 10000 1000000 --json

The scene is scenes/mirror_teapot.usda at the wanted tessellation, 1024 x 768, depth 7, one sample a pixel. The two
programs take turns, so that whatever else the machine does falls on both. Loading, parsing, building and compiling are
left out on both sides. Needs ``povray`` and, from the test data (WARP_RT_TEST_DATA, by default ``shared`` beside the
project), the exporter ``oracles/pov.py``.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import ModuleType

import numpy as np

from warp_rt import Film, Renderer, RenderOptions, Scene, load_scene
from warp_rt.scene import Light, LightKind, Material

ROOT = Path(__file__).resolve().parent.parent
WIDTH, HEIGHT, DEPTH, THRESHOLD = 1024, 768, 7, 0.0


def main() -> None:
    """Run the benchmark that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--triangles", type=int, nargs="+", default=[10_000], help="wanted sizes of the teapot")
    parser.add_argument("--repeats", type=int, default=5, help="turns of each program; their median counts")
    parser.add_argument("--povray", default="povray", help="the program")
    parser.add_argument("--json", action="store_true", help="print one JSON array and nothing else")
    arguments = parser.parse_args()
    if shutil.which(arguments.povray) is None:
        sys.exit(f"frame_vs_povray: no program {arguments.povray!r}: install POV-Ray 3.7 (Debian package povray)")
    results = [run_size(count, arguments.repeats, arguments.povray) for count in arguments.triangles]
    if arguments.json:
        print(json.dumps(results, indent=2))
        return
    for result in results:
        print(
            f"{result['triangles']:>9,} triangles: warp_rt {result['warp_rt_cpu_s']:.3f} CPU s, POV-Ray "
            f"{result['povray_cpu_s']:.3f} CPU s, ratio {result['ratio']:.3f} ({result['pixels_alike']:.2%} of the "
            f"pixels alike, {result['tree_rays']:,} + {result['shadow_rays']:,} rays)"
        )


def run_size(triangle_count: int, repeats: int, povray: str) -> dict[str, object]:
    """Return the figures for a teapot of about ``triangle_count`` triangles."""
    pov, oracle = (load_oracle(name) for name in ("pov", "oracle"))
    with tempfile.TemporaryDirectory() as folder:
        stage, exported, picture = (str(Path(folder, name)) for name in ("scene.usdc", "scene.pov", "scene.ppm"))
        segments = round(np.sqrt(triangle_count / 64 + 1 / 256) + 1 / 16)  # inverse of 64 n^2 - 8 n
        script = ROOT / "scenes" / "make_mirror_teapot.py"
        subprocess.run([sys.executable, str(script), stage, "--segments", str(segments)], check=True)
        scene = load_scene(stage)
        pov.write(oracle_scene(oracle, scene), exported, DEPTH, THRESHOLD, "opaque")
        options = RenderOptions(width=WIDTH, height=HEIGHT, depth=DEPTH, threshold=THRESHOLD, threads=1)
        renderer = Renderer(scene, options, device="cpu")
        film = renderer.render()  # warms caches up
        ours, theirs = [], []
        for _ in range(repeats):
            start = time.process_time()
            film = renderer.render()
            ours.append(time.process_time() - start)
            _, log = pov.run(exported, picture, WIDTH, HEIGHT, 1, exe=povray)
            theirs.append(trace_cpu_seconds(log))
        alike = pixels_alike(film, pov.ppm(picture))
    return {
        "triangles": scene.triangle_count,
        "warp_rt_cpu_s": statistics.median(ours),
        "povray_cpu_s": statistics.median(theirs),
        "ratio": statistics.median(ours) / statistics.median(theirs),
        "warp_rt_runs": ours,
        "povray_runs": theirs,
        "pixels_alike": alike,
        "tree_rays": film.rays.primary + film.rays.reflection + film.rays.refraction,
        "shadow_rays": film.rays.shadow,
    }


def load_oracle(name: str) -> ModuleType:
    """Return one of the oracles' modules; they import each other by their bare names."""
    data = Path(os.environ.get("WARP_RT_TEST_DATA") or ROOT.parent / "shared")
    path = data / "oracles" / f"{name}.py"
    if not path.is_file():
        sys.exit(f"frame_vs_povray: {path} is not there: set WARP_RT_TEST_DATA to the folder that holds oracles/")
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault(name, module)
    spec.loader.exec_module(module)
    return module


def trace_cpu_seconds(log: str) -> float:
    """Return the CPU seconds that POV-Ray's statistics give for the trace."""
    found = re.search(r"Trace Time:.*?with\s+([\d.]+)\s+CPU-seconds", log, re.DOTALL)
    if found is None:
        raise SystemExit("frame_vs_povray: POV-Ray printed no trace time")
    return float(found.group(1))


def pixels_alike(film: Film, other: np.ndarray) -> float:
    """Return the fraction of pixels within 1e-3; POV-Ray weighs total internal reflection by 1, we by Kr + Kt."""
    return float((np.abs(np.clip(film.color, 0, 1) - other).max(axis=-1) <= 1e-3).mean())


def oracle_scene(oracle: ModuleType, scene: Scene) -> object:
    """Return a scene as the exporter takes it: world-space triangles, a normal a corner, one body an instance."""
    vertices, faces, normals, materials, bodies = [], [], [], [], []
    first = 0
    for row, mesh_row in enumerate(scene.instances.mesh):
        mesh, matrix = scene.meshes[mesh_row], scene.instances.world_from_local[row]
        points = mesh.points @ matrix[:3, :3].T + matrix[:3, 3]
        corner = points[mesh.triangles]
        if mesh.normals is None:
            normal = np.repeat(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, None], 3, axis=1)
        else:
            normal = mesh.normals.values[mesh.normals.indices] @ np.linalg.inv(matrix[:3, :3])
        slots = np.zeros(len(corner), int) if mesh.material_slots is None else mesh.material_slots
        vertices.append(points)
        faces.append(mesh.triangles + first)
        normals.append(normal / np.linalg.norm(normal, axis=-1, keepdims=True))
        materials.append(scene.instances.material_table[scene.instances.material_offset[row] + slots])
        bodies.append(np.full(len(corner), row))
        first += len(points)
    arrays = {"v": vertices, "f": faces, "n": normals, "mat": materials, "obj": bodies}
    settings = scene.settings
    description = {
        "camera": oracle_camera(scene),
        "ambient": list(settings.ambient),
        "background": list(settings.background),
        "lights": [oracle_light(light) for light in scene.lights],
        "materials": [oracle_material(material) for material in scene.materials],
    }
    return oracle.Scene(description, {key: np.concatenate(value) for key, value in arrays.items()})


def oracle_camera(scene: Scene) -> dict[str, object]:
    """Return the first camera; its window is symmetric and has the picture's aspect ratio."""
    camera = scene.cameras[0]
    right, up, back, eye = camera.world_from_camera[:3, :].T
    left_edge, right_edge, bottom, top = camera.window
    frame = {"eye": eye, "dir": -back, "right": right * (right_edge - left_edge), "up": up * (top - bottom)}
    return {key: value.tolist() for key, value in frame.items()} | {"width": WIDTH, "height": HEIGHT}


def oracle_light(light: Light) -> dict[str, object]:
    """Return a lecture's point light or a distant light of angle 0; the scene has no other."""
    if light.kind == LightKind.DISTANT:
        color = [channel / np.pi for channel in light.radiance]
        return {"type": "directional", "direction": (-light.world_from_light[:3, 2]).tolist(), "color": color}
    return {"type": "point", "position": light.world_from_light[:3, 3].tolist(), "color": list(light.radiance)}


def oracle_material(material: Material) -> dict[str, object]:
    """Return the constants of a WhittedSurface; whatever else the scene leaves out is black by default."""

    def constant(name: str, default: float) -> list[float]:
        return list(material.inputs[name].value) if name in material.inputs else [default] * 4

    names = {"ambient": "ka", "diffuse": "kd", "specular": "ks", "reflection": "kr", "transmission": "kt"}
    colors = {short: constant(name, 0.0)[:3] for name, short in names.items()}
    return colors | {"n": constant("shininess", 32.0)[0], "ior": constant("ior", 1.5)[0]}


if __name__ == "__main__":
    main()
