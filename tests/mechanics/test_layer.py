"""The bonded elastic layer against numerical solutions of the same equations."""

import numpy as np
import pytest
from scipy.linalg import expm

from optisense.mechanics._layer import SquareLoad, half_space_compliance, layer_compliance


def solved_numerically(a, nu):
    """Plane strain: q mu times the displacement by shear and by pressure, (2, 2).

    The state (u, w, s, t) stands for displacements u exp(iqx) and i w exp(iqx) and stresses
    s exp(iqx) and i t exp(iqx); it obeys linear equations in the height, and is (0, 0, s, t) at
    the base. Here q = mu = 1 and the height is a.
    """
    lame = 2 * nu / (1 - 2 * nu)
    p_wave = lame + 2
    matrix = np.zeros((4, 4))
    matrix[0] = [0, 1, 1, 0]
    matrix[1] = [-lame / p_wave, 0, 0, 1 / p_wave]
    matrix[2] = p_wave * np.array([1, 0, 0, 0]) + lame * matrix[1]
    matrix[3] = [0, 0, -1, 0]
    carried = expm(matrix * a)
    return carried[:2, 2:] @ np.linalg.inv(carried[2:, 2:])


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.45, 0.499])
@pytest.mark.parametrize("a", [0.05, 0.4, 1.5, 6.0])
def test_compliance_is_the_solution_of_the_equations_of_elasticity(nu, a):
    found = layer_compliance(a, nu)
    exact = solved_numerically(a, nu)
    assert found.normal == pytest.approx(exact[1, 1], rel=1e-6)
    assert found.along == pytest.approx(exact[0, 0], rel=1e-6)
    assert found.cross == pytest.approx(exact[0, 1], rel=1e-6, abs=1e-9)
    assert found.across == pytest.approx(np.tanh(a))


def test_thick_layers_yield_as_a_half_space_and_thin_ones_by_the_oedometric_modulus():
    nu = 0.3
    assert layer_compliance(40.0, nu) == pytest.approx(half_space_compliance(nu))
    # Wholly confined, a layer of thickness h and shear modulus mu yields by h / M, where
    # M = 2 mu (1 - nu) / (1 - 2 nu).
    confined = (1 - 2 * nu) / (2 * (1 - nu))
    assert layer_compliance(1e-3, nu).normal / 1e-3 == pytest.approx(confined, rel=1e-4)


def test_kernels_are_the_transforms_of_the_compliances():
    nu, h, pitch, count = 0.42, 1.0, 1 / 64, 1536
    q = 2 * np.pi * np.fft.fftfreq(count, pitch)
    qx, qy = np.broadcast_arrays(q[None, :], q[:, None])
    length = np.hypot(qx, qy)
    some = np.where(length > 0, length, 1.0)
    side = 8 * pitch
    load = side**2 * np.sinc(qx * side / 2 / np.pi) * np.sinc(qy * side / 2 / np.pi) / pitch**2
    by_q = layer_compliance(length * h, nu)
    rest = layer_compliance(1e-6, nu)
    normal, along, across, cross = (
        np.where(length > 0, value / some, at_rest / 1e-6) * load
        for value, at_rest in zip(by_q, rest, strict=True)
    )
    x, y = np.meshgrid(np.array([16, 40, 100, 200]), np.array([12, 30, -64, 150]))
    cosine, sine = qx / some, qy / some

    def at_places(values):
        return np.real(np.fft.ifft2(values))[y, x]

    square = SquareLoad(side, h, 1.0, nu)
    places = x * pitch, y * pitch
    found = {"zz": square.pressed_in(*places), **square.kernels(*places)._asdict()}
    expected = {
        "zz": normal,
        "xz": 1j * cosine * cross,
        "yz": 1j * sine * cross,
        "xx": along * cosine**2 + across * sine**2,
        "yy": along * sine**2 + across * cosine**2,
        "xy": (along - across) * cosine * sine,
    }
    for name, spectrum in expected.items():
        exact = at_places(spectrum)
        error = np.abs(found[name] - exact).max() / np.abs(exact).max()
        # The layer's correction is that of a point, and the reference is periodic.
        assert error < 0.01, name


def test_a_square_on_a_thick_layer_sinks_as_love_says():
    side, mu, nu = 0.5, 0.7, 0.3
    middle = SquareLoad(side, 1e4, mu, nu).pressed_in(np.zeros(1), np.zeros(1))[0]
    # Love 1929: at the middle of a square, (1 - nu) / (pi mu) * 4 ln(1 + sqrt 2) * side / 2
    exact = (1 - nu) / (np.pi * mu) * 2 * np.log(1 + np.sqrt(2)) * side
    assert middle == pytest.approx(exact, rel=1e-3)
