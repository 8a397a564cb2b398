#!/usr/bin/env python3
"""The published Gate-SDF network in PyTorch: out of a Gatefield bundle, and into one (docs/bring-your-own-network.md).

    pytorch_network.py --from BUNDLE --out FOLDER    weights of a bundle that gatefield-train made with the plain design
    pytorch_network.py --out FOLDER                  an untrained network

Between load() and save() in main() is the place for training of your own. Needs torch, numpy and onnx
(Debian: python3-torch python3-onnx).
"""
import argparse
import hashlib
import inspect
import math
import pathlib

import onnx
import onnx.helper
import onnx.numpy_helper
import torch
from torch import nn

MANIFEST = {  # common/model/manifest.proto says what each means
    "name": '"mine"', "encoder_kind": '"plain"', "decoder_kind": "CONCATENATED", "latent_size": "128",
    "encoding_octaves": "4", "position_scale_m": "5", "image_width_px": "160", "image_height_px": "90",
    "horizontal_fov_rad": "1.51843645", "vertical_fov_rad": "1.01229097", "min_depth_m": "0.3", "max_depth_m": "10",
    "cone_angle_rad": "0.34906585", "gate_inner_half_m": "0.5", "validity_threshold": "0.5"}


def image_of(depth):
    """Depth in metres [batch, rows, columns], 0 = no return -> inverse depth and validity, as the server feeds them."""
    seen = (depth > 0).float()
    return torch.stack([seen / depth.clamp(min=1e-3), seen], 1)


class Encoder(nn.Module):
    """image [1, 2, rows, columns] -> code [1, latent + 2]: latent, logit of validity, logarithm of the expected error."""

    def __init__(self, rows, columns, latent=128, widths=(16, 32, 64, 96, 96), dense=192):
        super().__init__()
        inputs = 2
        for i, (width, kernel, stride) in enumerate(zip(widths, (5, 3, 3, 3, 3), (2, 2, 2, 2, 1)), 1):
            setattr(self, f"conv{i}", nn.Conv2d(inputs, width, kernel, stride, kernel // 2))
            inputs, rows, columns = width, -(-rows // stride), -(-columns // stride)
        self.dense = nn.Linear(inputs * rows * columns, dense)
        self.output = nn.Linear(dense, latent + 2)

    def forward(self, image):
        for i in range(1, 6):
            image = torch.relu(getattr(self, f"conv{i}")(image))
        return self.output(torch.relu(self.dense(image.flatten(1))))


class Decoder(nn.Module):
    """latent [1, latent], points [N, 3] in the camera frame, metres -> sdf [N, 1], metres."""

    def __init__(self, latent=128, octaves=4, scale_m=5.0, widths=(128, 128, 128)):
        super().__init__()
        self.frequencies = [2.0**octave * math.pi / scale_m for octave in range(octaves)]
        self.layers = len(widths) + 1
        for i, (inputs, outputs) in enumerate(zip((latent + 3 + 6 * octaves, *widths), (*widths, 1))):
            setattr(self, f"layer{i}", nn.Linear(inputs, outputs))

    def forward(self, latent, points):
        parts = [latent.expand(points.shape[0], -1), points]
        for frequency in self.frequencies:
            parts += [torch.sin(frequency * points), torch.cos(frequency * points)]
        x = torch.cat(parts, 1)
        for i in range(self.layers - 1):
            x = torch.relu(getattr(self, f"layer{i}")(x))
        return getattr(self, f"layer{self.layers - 1}")(x)


def load(folder):
    """Encoder, decoder and manifest of a bundle with the published layers."""
    def tensors(file):
        graph = onnx.load(str(folder / file)).graph
        return {t.name: torch.from_numpy(onnx.numpy_helper.to_array(t).copy()) for t in graph.initializer}

    lines = [line.split(":", 1) for line in (folder / "manifest.txt").read_text().splitlines() if not line.startswith("#")]
    manifest = {name.strip(): value.strip() for name, value in lines}
    weights = tensors("encoder.onnx")
    encoder = Encoder(int(manifest["image_height_px"]), int(manifest["image_width_px"]), int(manifest["latent_size"]),
                      [len(weights[f"conv{i}.weight"]) for i in range(1, 6)], len(weights["dense.weight"]))
    encoder.load_state_dict({name: weights[name] for name in encoder.state_dict()})
    weights = tensors("decoder.onnx")
    widths = [len(weights[f"layer{i}.weight"]) for i in range(sum(name.startswith("layer") for name in weights) // 2)]
    decoder = Decoder(int(manifest["latent_size"]), int(manifest["encoding_octaves"]),
                      float(manifest["position_scale_m"]), widths[:-1])
    decoder.load_state_dict({name: weights[name] for name in decoder.state_dict()})
    return encoder, decoder, manifest


def export(network, values, names, output, file, open_axis=None, opset=None):
    """Writes a network, and beside it test vectors, which the server holds it against. Arguments and inputs share names."""
    network.eval()
    options = {"input_names": names, "output_names": [output], **({"opset_version": opset} if opset else {})}
    if "dynamo" in inspect.signature(torch.onnx.export).parameters:
        options["dynamo"] = True  # the default since PyTorch 2.9
        if open_axis:
            options["dynamic_shapes"] = {name: {0: torch.export.Dim("N")} if name == open_axis else None for name in names}
    elif open_axis:
        options["dynamic_axes"] = {open_axis: {0: "N"}, output: {0: "N"}}
    torch.onnx.export(network, values, str(file), **options)
    with torch.no_grad():
        tensors = dict(zip([*names, output], [*values, network(*values)]))
    graph = onnx.helper.make_graph([], "test", [], [], [
        onnx.numpy_helper.from_array(value.numpy(), name) for name, value in tensors.items()])
    onnx.save(onnx.helper.make_model(graph), str(file.with_suffix(".test.onnx")))


def save(encoder, decoder, manifest, folder, opset=None):
    """Writes the files of a bundle."""
    folder.mkdir(parents=True, exist_ok=True)
    depth = 0.5 + 5.0 * torch.rand(1, int(manifest["image_height_px"]), int(manifest["image_width_px"]))
    export(encoder, (image_of(depth),), ["image"], "code", folder / "encoder.onnx", opset=opset)
    points = torch.randn(8, 3)  # 8: any number, N is left open
    export(decoder, (torch.randn(1, int(manifest["latent_size"])), points), ["latent", "points"], "sdf",
           folder / "decoder.onnx", "points", opset)
    (folder / "manifest.txt").write_text("".join(f"{name}: {value}\n" for name, value in manifest.items()))
    files = [folder / "manifest.txt", *sorted(folder.glob("*.onnx*"))]
    (folder / "SHA256SUMS").write_text(
        "".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files))


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--from", dest="source", type=pathlib.Path, help="a bundle to begin with")
    arguments.add_argument("--out", type=pathlib.Path, required=True, help="the bundle's folder")
    arguments.add_argument("--opset", type=int, help="11 to 21 (as the exporter likes)")
    options = arguments.parse_args()
    if options.source:
        encoder, decoder, manifest = load(options.source)
    else:
        encoder, decoder, manifest = Encoder(90, 160), Decoder(), MANIFEST
    # Train here: encoder(image_of(depth)) and decoder(latent, points), in metres and the camera's frame.
    save(encoder, decoder, {**manifest, "name": f'"{options.out.name}"'}, options.out, options.opset)


if __name__ == "__main__":
    main()
