"""A quadrotor of half a kilogram, as rotorpy's parameter files say it."""
import numpy as np

d = 0.16  # arm

quad_params = {
    'mass': 0.5,
    'Ixx': 3.0e-3,
    'Iyy': 3.2e-3,
    'Izz': 5.5e-3,
    'Ixy': 0.0,
    'Iyz': 0.0,
    'Ixz': 0.0,
    'num_rotors': 4,
    'rotor_radius': 0.08,
    'rotor_pos': {
        'r1': d * np.array([np.sqrt(0.5), np.sqrt(0.5), 0]),
        'r2': d * np.array([np.sqrt(0.5), -np.sqrt(0.5), 0]),
        'r3': d * np.array([-np.sqrt(0.5), -np.sqrt(0.5), 0]),
        'r4': d * np.array([-np.sqrt(0.5), np.sqrt(0.5), 0]),
    },
    'rotor_directions': np.array([1, -1, 1, -1]),
    'c_Dx': 0.004,
    'c_Dy': 0.004,
    'c_Dz': 0.01,
    'k_eta': 5.0e-6,
    'k_m': 1.0e-7,
    'k_d': 1.0e-4,
    'k_z': 2.0e-4,
    'tau_m': 0.02,
    'rotor_speed_min': 100,
    'rotor_speed_max': 1200,
}
