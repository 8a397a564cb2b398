"""Quadrotors in front of gates, in NumPy: dynamics, motors, a depth camera and a referee, for any number of vehicles.

Arrays have the vehicles as first axis: p_W is (n, 3). W is ENU, B is FLU, quaternions are w, x, y, z.
It knows where the gates stand; nobody tells the server.
"""

import numpy as np

import gatefield

GRAVITY_W = np.array([0.0, 0.0, -9.81])


def rotation(q):
    """Matrices (n, 3, 3) that turn vectors of B into W."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    return np.moveaxis(np.array(rows), -1, 0)


class Quadrotors:
    """Rigid bodies whose rotors follow what they are asked for with a first-order lag."""

    def __init__(self, model: gatefield.Quadrotor, p_W, yaw_rad):
        self.model = model
        count = len(p_W)
        self.p_W = np.array(p_W, float)
        self.v_W = np.zeros((count, 3))
        half = np.broadcast_to(np.asarray(yaw_rad, float) / 2, (count,))
        self.q = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
        self.w_B = np.zeros((count, 3))
        hover = model.mass_kg * -GRAVITY_W[2] / 4
        self.thrust = np.full((count, 4), hover)
        self.command = self.thrust.copy()
        place = np.array(model.rotor_position_B_m)
        self._mixer = np.stack([place[:, 1], -place[:, 0], model.torque_per_thrust_m * np.array(model.rotor_spin)])
        self._inertia = np.array(model.inertia_kg_m2)
        self._drag = np.array(model.drag_kg_s)

    def _rates(self, v_W, q, w_B, thrust):
        R = rotation(q)
        v_B = np.einsum("nji,nj->ni", R, v_W)
        force_B = -self._drag * v_B
        force_B[:, 2] += thrust.sum(axis=1)
        a_W = np.einsum("nij,nj->ni", R, force_B) / self.model.mass_kg + GRAVITY_W
        torque = thrust @ self._mixer.T
        w_dot = (torque - np.cross(w_B, self._inertia * w_B)) / self._inertia
        w, v = q[:, :1], q[:, 1:]
        q_dot = 0.5 * np.concatenate([-(v * w_B).sum(axis=1, keepdims=True), w * w_B + np.cross(v, w_B)], axis=1)
        return v_W, a_W, q_dot, w_dot

    def step(self, command, dt_s):
        """One step of the midpoint rule, in which the rotors follow `command` (n, 4), N."""
        model = self.model
        self.command = np.clip(command, model.thrust_min_n, model.thrust_max_n)
        lag = np.exp(-dt_s / 2 / model.rotor_time_constant_s)
        middle = self.command + (self.thrust - self.command) * lag
        begin = (self.p_W, self.v_W, self.q, self.w_B)
        slope = self._rates(*begin[1:], self.thrust)
        half = [x + dt_s / 2 * d for x, d in zip(begin, slope)]
        slope = self._rates(*half[1:], middle)
        self.p_W, self.v_W, self.q, self.w_B = [x + dt_s * d for x, d in zip(begin, slope)]
        self.q /= np.linalg.norm(self.q, axis=1, keepdims=True)
        self.thrust = self.command + (middle - self.command) * lag

    def state(self, i) -> gatefield.State:
        return gatefield.State(self.p_W[i], self.v_W[i], self.q[i], self.w_B[i], self.thrust[i], self.command[i])


class Gates:
    """Where the gates of a course really stand: centres (g, 3) and axes (g, 3, 3), x through the opening."""

    def __init__(self, course: gatefield.Course, offset_m=0.0, seed=1):
        random = np.random.default_rng(seed)
        told = np.array([waypoint.p_W for waypoint in course.waypoints])
        shift = random.normal(size=told.shape)
        self.center_W = told + offset_m * shift / np.linalg.norm(shift, axis=1, keepdims=True)
        x = np.array([waypoint.direction_W for waypoint in course.waypoints])
        y = np.cross([0.0, 0.0, 1.0], x)
        y /= np.linalg.norm(y, axis=1, keepdims=True)
        self.axes_W = np.stack([x, y, np.cross(x, y)], axis=2)
        self.shape = course.waypoints[0].gate

    def bars(self):
        """Centres (4, 3) and half sizes (4, 3) of the frame's bars in a gate's own axes."""
        shape = self.shape
        middle = (shape.inner_half_m + shape.outer_half_m) / 2
        half = (shape.outer_half_m - shape.inner_half_m) / 2
        x = shape.thickness_m / 2
        centers = [[0, -middle, 0], [0, middle, 0], [0, 0, -middle], [0, 0, middle]]
        halves = [[x, half, shape.outer_half_m]] * 2 + [[x, shape.outer_half_m, half]] * 2
        return np.array(centers, float), np.array(halves, float)


class DepthCamera:
    """Ray-casts the gates' frames and the floor at z = 0: depth along the optical axis, m, float32."""

    def __init__(self, camera: gatefield.Camera, gates: Gates):
        self.camera, self.gates = camera, gates
        u, v = np.meshgrid(np.arange(camera.width_px) + 0.5, np.arange(camera.height_px) + 0.5)
        self._rays_C = np.stack([(u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, np.ones_like(u)],
                                axis=-1).reshape(-1, 3)
        self._X_BC = np.array(camera.X_BC)

    def image(self, p_W, q):
        """What one vehicle at p_W (3,) with attitude q (4,) sees, shape (height, width)."""
        R_WB = rotation(q[None])[0]
        p_WC = p_W + R_WB @ self._X_BC[:3, 3]
        rays_W = self._rays_C @ (R_WB @ self._X_BC[:3, :3]).T
        nearest = np.full(len(rays_W), np.inf)
        with np.errstate(divide="ignore", invalid="ignore"):
            floor = np.where(rays_W[:, 2] < 0, -p_WC[2] / rays_W[:, 2], np.inf)
            for center_W, axes_W in zip(self.gates.center_W, self.gates.axes_W):
                from_G = (p_WC - center_W) @ axes_W
                if np.linalg.norm(from_G) > self.camera.max_depth_m + 2:
                    continue
                rays_G = rays_W @ axes_W
                for middle, half in zip(*self.gates.bars()):
                    a = (middle - half - from_G) / rays_G
                    b = (middle + half - from_G) / rays_G
                    enters = np.minimum(a, b).max(axis=1)
                    leaves = np.maximum(a, b).min(axis=1)
                    hit = (enters > 0) & (enters <= leaves)
                    nearest[hit] = np.minimum(nearest[hit], enters[hit])
        depth = np.minimum(nearest, floor)
        seen = (depth >= self.camera.min_depth_m) & (depth <= self.camera.max_depth_m)
        shape = (self.camera.height_px, self.camera.width_px)
        return np.where(seen, depth, 0).astype(np.float32).reshape(shape)


class Referee:
    """Counts gates that were flown through in their order, and sees who touched a frame or the floor."""

    def __init__(self, course: gatefield.Course, gates: Gates, radius_m, count):
        self.gates, self.radius_m = gates, radius_m
        self.due = len(course.waypoints) * course.laps
        self.passed = np.zeros(count, int)
        self.touched = np.zeros(count, bool)
        self._before = None

    def watch(self, p_W):
        """After every step. @param p_W (n, 3)"""
        local = np.einsum("ngi,gij->ngj", p_W[:, None] - self.gates.center_W, self.gates.axes_W)
        away = np.abs(local[..., 1:]).max(axis=2)
        shape, radius = self.gates.shape, self.radius_m
        in_frame = ((np.abs(local[..., 0]) < radius) & (away > shape.inner_half_m - radius) &
                    (away < shape.outer_half_m + radius))
        self.touched |= in_frame.any(axis=1) | (p_W[:, 2] < radius)
        if self._before is not None:
            i = np.arange(len(p_W))
            target = self.passed % len(self.gates.center_W)
            through = (self._before[i, target, 0] < 0) & (local[i, target, 0] >= 0)
            self.passed += through & (away[i, target] < shape.inner_half_m) & (self.passed < self.due)
        self._before = local

    @property
    def done(self):
        """Of each vehicle: nothing is left to fly for."""
        return self.touched | (self.passed >= self.due)

    @property
    def won(self):
        return ~self.touched & (self.passed >= self.due)
