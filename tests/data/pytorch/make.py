#!/usr/bin/env python3
"""Makes the files beside it: networks as PyTorch writes them, and what PyTorch makes of some numbers (expected.txt).

They were written with PyTorch 1.13.1 and ONNX 1.12 (Debian 12); tests/unit/server/perception/pytorch_test.cpp reads them.
"""
import math
import pathlib
import sys
import warnings

import numpy
import torch
from torch import nn
import torch.nn.functional as F

here = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(here / "../../../docs/examples"))
import pytorch_network as example  # noqa: E402

ROWS, COLUMNS, LATENT, OCTAVES, SCALE_M = 16, 32, 12, 4, 5.0
MANIFEST = {**example.MANIFEST, "name": '"pytorch"', "latent_size": str(LATENT), "image_width_px": str(COLUMNS),
            "image_height_px": str(ROWS)}


class Assorted(nn.Module):
    """Layers that people use in encoders, one of each."""

    def __init__(self):
        super().__init__()
        self.conv = nn.Sequential(nn.Conv2d(2, 8, 3, 2, 1), nn.BatchNorm2d(8), nn.LeakyReLU(0.1))
        self.depthwise = nn.Sequential(nn.Conv2d(8, 8, 3, 1, 1, groups=8, bias=False), nn.ReLU6(), nn.Conv2d(8, 8, 1), nn.SiLU())
        self.squeeze = nn.Sequential(nn.AdaptiveAvgPool2d(1), nn.Conv2d(8, 8, 1), nn.Hardsigmoid())
        self.wide = nn.Sequential(nn.Conv2d(8, 8, 3, 1, 2, dilation=2), nn.PReLU(8), nn.MaxPool2d(3, 2, 1), nn.GELU())
        self.mix = nn.Sequential(nn.Conv2d(16, 8, 3, 1, 1), nn.Hardswish(), nn.AvgPool2d(2), nn.ELU(), nn.Dropout())
        self.maps = nn.Conv2d(8, 3, 1)
        self.output = nn.Linear(24 + 8 + 8 + 32, LATENT + 2)

    def forward(self, image):
        x = self.conv(image)
        x = x + self.depthwise(x)
        x = x * self.squeeze(x)
        deep = self.wide(x)
        x = self.mix(torch.cat([x, F.interpolate(deep, scale_factor=2.0, mode="bilinear", align_corners=False)], 1))
        left, right = F.interpolate(x, scale_factor=2.0).chunk(2, 1)
        rows = x.flatten(2)
        attention = torch.softmax(self.maps(x).flatten(2), 2)
        attended = torch.matmul(attention, rows.transpose(1, 2)).flatten(1)
        summary = F.normalize(x.mean((2, 3)), dim=1)
        most = torch.tanh(x.amax((2, 3)) - 0.5)
        part = (left[:, :, 1::2, ::4] / (1.0 + right[:, :, 1::2, ::4].abs())).reshape(1, -1)
        return self.output(torch.cat([attended, summary, most, part[:, :32]], 1))


class Decoder(nn.Module):
    """The published decoder, written in ways that lead to other graphs than the example's."""

    def __init__(self, way):
        super().__init__()
        self.way = way
        self.layer0, self.layer1 = nn.Linear(LATENT + 3 + 6 * OCTAVES, 24), nn.Linear(24, 16)
        self.layer2 = nn.Linear(16, 1)
        self.register_buffer("frequencies", 2.0 ** torch.arange(OCTAVES) * math.pi / SCALE_M)

    def forward(self, latent, points):
        n = points.shape[0]
        if self.way == "repeated":  # coordinates first, then octaves; all sines, then all cosines
            angles = (points.unsqueeze(-1) * self.frequencies).flatten(1)
            x = torch.cat([latent.repeat(n, 1), points, angles.sin(), angles.cos()], 1)
        elif self.way == "stacked":  # the latent last
            angles = points[:, None, :] * self.frequencies[:, None]
            waves = torch.stack([angles.sin(), angles.cos()], 2).reshape(n, -1)
            x = torch.cat([points, waves, latent.expand(n, LATENT)], -1)
        elif self.way == "rows":  # a latent for every point
            angles = torch.cat([frequency * points for frequency in self.frequencies], 1)
            x = torch.cat([latent, points, torch.sin(angles), torch.cos(angles)], 1)
        else:  # "split": the latent's part of the first layer once for all points
            angles = points[:, None, :] * self.frequencies[:, None]
            waves = torch.stack([angles.sin(), angles.cos()], 2).view(-1, 6 * OCTAVES)
            x = torch.cat([points, waves], 1) @ self.layer0.weight[:, LATENT:].t()
            x = torch.relu(x + (latent @ self.layer0.weight[:, :LATENT].t() + self.layer0.bias))
            return self.layer2(F.relu(self.layer1(x)))[:, 0]
        return self.layer2(torch.relu(self.layer1(torch.relu(self.layer0(x)))))


class HyperDecoder(nn.Module):
    """latent [1, 3 + z]: the centre and what makes the first layer."""

    def __init__(self, hidden=16):
        super().__init__()
        self.hidden = hidden
        self.generator = nn.Linear(LATENT, 4 * hidden)
        self.layer0, self.layer1 = nn.Linear(hidden, 20), nn.Linear(20, 1)

    def forward(self, latent, points):
        made = self.generator(latent[:, 3:])
        weight, bias = made[:, :3 * self.hidden].view(self.hidden, 3), made[:, 3 * self.hidden:]
        x = torch.relu((points - latent[:, :3]) / SCALE_M @ weight.t() + bias)
        return self.layer1(torch.relu(self.layer0(x)))


def wave(count, step, start=0.0):
    return torch.from_numpy(numpy.sin(step * numpy.arange(count) + start).astype(numpy.float32))


def main():
    warnings.simplefilter("ignore")
    torch.manual_seed(1)
    torch.set_num_threads(1)
    depth = (3.0 + 2.5 * wave(ROWS * COLUMNS, 0.37)).reshape(1, ROWS, COLUMNS)
    depth.view(-1)[::11] = 0.0
    points = 2.0 * wave(60, 1.3, 0.5).reshape(20, 3)
    latent = {LATENT: wave(LATENT, 0.7, 1.0).reshape(1, -1), LATENT + 3: wave(LATENT + 3, 0.7, 1.0).reshape(1, -1)}
    expected = {}

    encoder = example.Encoder(ROWS, COLUMNS, LATENT, (4, 6, 8, 8, 8), 16)
    decoder = example.Decoder(LATENT, OCTAVES, SCALE_M, (24, 16))
    for opset in (11, 14, 17):
        example.save(encoder, decoder, MANIFEST, here / f"opset{opset}", opset)
    expected["code"] = encoder(example.image_of(depth))
    expected["sdf"] = decoder(latent[LATENT], points)

    assorted = Assorted()
    assorted.conv[1].running_var.uniform_(0.5, 2.0)
    assorted.eval()
    for opset in (11, 17):
        torch.onnx.export(assorted, (example.image_of(depth),), str(here / f"assorted{opset}.onnx"), opset_version=opset,
                          input_names=["image"], output_names=["code"])
    expected["assorted"] = assorted(example.image_of(depth))

    for opset, way in ((11, "repeated"), (17, "stacked"), (13, "rows"), (17, "split"), (12, "hyper")):
        module = HyperDecoder() if way == "hyper" else Decoder(way)
        given = latent[LATENT + 3 if way == "hyper" else LATENT]
        given = given.expand(20, -1) if way == "rows" else given
        axes = {"points": {0: "N"}, "sdf": {0: "N"}, **({"latent": {0: "N"}} if way == "rows" else {})}
        torch.onnx.export(module, (given, points), str(here / f"decoder_{way}.onnx"), opset_version=opset,
                          input_names=["latent", "points"], output_names=["sdf"], dynamic_axes=axes)
        expected[way] = module(given, points)

    lines = [" ".join([name, *(f"{value:.7g}" for value in values.flatten().tolist())]) for name, values in expected.items()]
    (here / "expected.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
