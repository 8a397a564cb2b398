"""A race as an environment after Gymnasium's interface (nothing of it is imported): learn what to add to the plans.

    env = RaceEnv("circle", domain=0)
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(np.zeros(4))

Action: added to the plan's rotor thrusts, -1 to 1 of `authority_n` each; zeros fly the plan.
Observation: position to the next gate in its axes, velocity in B, where up is in B (the attitude matrix's third row),
body rates, thrusts: 3 + 3 + 3 + 3 + 4 numbers. It is the truth of the simulation; the server gets depth and state.
Reward: metres nearer to the gate; 1 for a gate, -10 for a touch. A step is one control period, 20 ms.
"""

import numpy as np

import gatefield
from numpy_world import DepthCamera, Gates, Quadrotors, Referee, rotation

STEP = 1_000_000
PERIOD = 20 * STEP
LONGEST = 60_000_000_000


class RaceEnv:
    """One vehicle, in lockstep with a server; reset() joins anew."""

    observation_shape = (16,)
    action_shape = (4,)

    def __init__(self, course="circle", domain=0, speed_limit_m_s=6.0, offset_m=0.3, authority_n=0.2, name="learner"):
        self.track = gatefield.Track.load(course)
        self.model = gatefield.Vehicle()
        self.options = {"domain": domain, "speed_limit_m_s": speed_limit_m_s, "vehicle": name, "timing": "lockstep"}
        self.offset_m, self.authority_n = offset_m, authority_n
        self.client = None

    def reset(self, *, seed=1, options=None):
        self.close()
        gates = Gates(self.track.course, self.offset_m, seed)
        self.camera = DepthCamera(self.model.camera, gates)
        self.body = Quadrotors(self.model.quadrotor, [self.track.start_p_WB], self.track.start_yaw_rad)
        self.referee = Referee(self.track.course, gates, self.model.quadrotor.collision_radius_m, count=1)
        self.stamp = 1_000_000_000
        self.client = gatefield.connect(self.track.course, model=self.model, seed=seed, timeout_s=20, **self.options)
        self.distance_m = np.linalg.norm(self._gate()[0])
        return self._observe(), {}

    def step(self, action):
        state = self.body.state(0)
        self.client.send_depth(self.stamp, self.camera.image(self.body.p_W[0], self.body.q[0]))
        plan = self.client.wait_for_answer(self.client.send_state(self.stamp, state))
        asked = self.client.play(self.stamp, state, PERIOD)
        thrust = asked.rotor_thrust_n + self.authority_n * np.clip(action, -1, 1)
        passed = self.referee.passed[0]
        for _ in range(PERIOD // STEP):
            self.body.step(thrust[None], STEP / 1e9)
            self.referee.watch(self.body.p_W)
        self.stamp += PERIOD
        distance_m = np.linalg.norm(self._gate()[0])
        through = self.referee.passed[0] - passed
        reward = float(through if through else self.distance_m - distance_m)
        self.distance_m = distance_m
        touched = bool(self.referee.touched[0])
        info = {"gates": int(self.referee.passed[0]), "won": bool(self.referee.won[0]), "source": asked.source,
                "plan": plan}
        late = self.stamp > LONGEST
        return self._observe(), reward - 10 * touched, bool(self.referee.done[0]), late, info

    def close(self):
        if self.client is not None:
            self.client.close()
            self.client = None

    def _gate(self):
        gates = self.referee.gates
        i = self.referee.passed[0] % len(gates.center_W)
        return (self.body.p_W[0] - gates.center_W[i]) @ gates.axes_W[i], i

    def _observe(self):
        R = rotation(self.body.q)[0]
        return np.concatenate([self._gate()[0], R.T @ self.body.v_W[0], R[2], self.body.w_B[0], self.body.thrust[0]])
