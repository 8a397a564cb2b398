"""Calibrations as ROS, OpenCV and RealSense write them down."""

from .cameras import Lens, five_terms
from .source import Node, attribute, read_json, read_xml, read_yaml

_MATRIX = ("camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K", "M1", "intrinsics",
           "intrinsic_matrix")
_TERMS = ("distortion_coefficients", "Distortion_Coefficients", "distCoeffs", "dist_coeffs", "distortion", "D", "D1")
_WIDTH, _HEIGHT = ("image_width", "image_Width", "width"), ("image_height", "image_Height", "height")
_NO_TERMS = ("none", "", "distortion.none")


def _matrix(node, columns):
    """Rows of a matrix that is a list, a list of rows, or a table with `data`."""
    data = node.find("data")
    values = [item for row in (data or node).nodes("a matrix") for item in (row.nodes() if isinstance(row.value, list)
                                                                           else [row])]
    if len(values) != 3 * columns:
        (data or node).refuse(f"a matrix of 3 rows and {columns} columns")
    numbers = [item.number() for item in values]
    return [numbers[i:i + columns] for i in range(0, len(numbers), columns)]


def _pinhole(node, columns=3):
    """Focal lengths and principal point."""
    rows = _matrix(node, columns)
    if rows[0][0] <= 0 or rows[1][1] <= 0 or abs(rows[2][2] - 1) > 1e-6:
        node.refuse("a camera matrix with focal lengths above 0 and a last row of 0, 0, 1")
    if abs(rows[0][1]) > 1e-3 * rows[0][0]:
        node.refuse("no skew in row 1, column 2")
    return (rows[0][0], rows[1][1]), (rows[0][2], rows[1][2])


def _size(root):
    width, height = root.find(*_WIDTH), root.find(*_HEIGHT)
    pair = root.find("image_size", "imageSize", "resolution")
    if width is not None and height is not None:
        return width.whole(1, 100000, "pixels"), height.whole(1, 100000, "pixels")
    if pair is not None:
        return tuple(int(value) for value in pair.vector(2, "width and height in pixels"))
    return None


def read_ros(path, options):
    """camera_info YAML of camera_calibration, or a CameraInfo message as `ros2 topic echo` shows it."""
    root = read_yaml(path)
    region = root.find("roi")
    if region is not None and any(region.find(key) is not None and region.find(key).number() != 0
                                  for key in ("x_offset", "y_offset", "width", "height")):
        region.refuse("the whole image: give the calibration of the images as they are sent")
    lens = Lens(*_pinhole(root.need("camera_matrix", "K", "k")), _size(root))
    model = root.find("distortion_model")
    terms = root.find("distortion_coefficients", "D", "d")
    projection = root.find("projection_matrix", "P", "p")
    if options.rectified and projection is not None:
        lens.focal_px, lens.centre_px = _pinhole(projection, 4)
        lens.notes.append("of rectified images: the projection matrix was taken")
    elif terms is not None and not options.rectified:
        if model is not None and model.value not in ("plumb_bob", "rational_polynomial", *_NO_TERMS):
            model.refuse("plumb_bob, or rectified images and --rectified")
        lens.distortion = five_terms(terms.find("data") or terms)
    binning = [root.find(key) for key in ("binning_x", "binning_y")]
    bins = [node.whole(0, 64, "pixels") if node is not None else 0 for node in binning]
    if max(bins) > 1:
        root.find("binning_x").refuse("0 or 1: give the calibration of the images as they are sent, or --decimate")
    return lens


def read_opencv(path, options):
    """FileStorage, YAML or XML, as OpenCV's calibration programs write it."""
    root = _storage(path) if path.suffix.lower() == ".xml" else read_yaml(path)
    names = (options.matrix,) if options.matrix else _MATRIX
    lens = Lens(*_pinhole(root.need(*names)), _size(root))
    terms = root.find(*_TERMS)
    if terms is not None:
        inner = terms.find("data") or terms
        flat = [item.value for row in inner.nodes() for item in (row.nodes() if isinstance(row.value, list) else [row])]
        lens.distortion = five_terms(Node(path, flat, inner.path))
    if root.find("fisheye_model") is not None and root.find("fisheye_model").number() != 0 and not options.rectified:
        root.find("fisheye_model").refuse("0, or rectified images and --rectified")
    return lens


def _storage(path):
    """An <opencv_storage> as the table that its YAML would be."""
    root = read_xml(path)
    table = {}
    for element in root:
        if element.find("data") is not None:
            table[element.tag] = {"data": _numbers(path, element.find("data"))}
        elif len(element) == 0 and element.text:
            values = _numbers(path, element)
            table[element.tag] = values[0] if len(values) == 1 else values
    return Node(path, table)


def _numbers(path, element):
    value = attribute(path, type(element)("x", {"x": element.text or ""}), "x").value
    return value if isinstance(value, list) else [value]


def read_realsense(path, options):
    """rs2_intrinsics as JSON: width, height, fx, fy, ppx, ppy, model, coeffs; in a table of streams, --stream's."""
    root = read_json(path)
    stream = root
    if root.find("fx") is None:
        stream = root.need(options.stream or "depth")
        stream = stream.find("intrinsics") or stream
    focal = tuple(stream.need(key).positive("a focal length in pixels above 0") for key in ("fx", "fy"))
    centre = tuple(stream.need(*keys).number() for keys in (("ppx", "cx"), ("ppy", "cy")))
    lens = Lens(focal, centre, _size(stream))
    terms = stream.find("coeffs", "distortion_coeffs")
    model = stream.find("model", "distortion_model")
    if terms is not None:
        lens.distortion = five_terms(terms)
        name = str(model.value).lower() if model is not None else "brown_conrady"
        if any(lens.distortion) and name.split(".")[-1] != "brown_conrady" and not options.rectified:
            model.refuse("brown_conrady, or coefficients of 0, or rectified images and --rectified")
    scale = root.find("depth_scale") or stream.find("depth_scale")
    if scale is not None:
        lens.metres_per_count = scale.number(1e-6, 0.1, "metres per count, 0.000001 to 0.1")
    return lens
