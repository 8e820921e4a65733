# SPDX-License-Identifier: Apache-2.0
"""Laws of the generator's physics and of its measure of strength. Run: python3 -m unittest discover -s tests/blind"""
import unittest

import numpy as np

import effects
import noise
import profiles
import thermal


class CoilHeat(unittest.TestCase):
    def test_insulated_slab_keeps_its_heat_and_evens_out(self):
        start = np.linspace(0.0, 40.0, thermal.CELLS)
        jacobian = thermal.slab_laplacian(thermal.CELLS, 60.0)
        states = thermal.integrate(jacobian, np.zeros((thermal.CELLS, 1)), np.zeros((3000, 1)), start, 1.0)
        heat = states.sum(axis=1)
        # rounding: 3000 steps of 20 sums of numbers near 20
        self.assertLess(np.abs(heat - heat[0]).max(), 3000 * 20 * 20 * 2.3e-16 * 10)
        # slowest mode: tau = 60 s, after 3000 s exp(-50) of 40 °C is left
        self.assertLess(np.ptp(states[-1]), 1e-9)

    def test_slowest_mode_of_the_slab_decays_with_the_diffusion_time(self):
        depth = (np.arange(thermal.CELLS) + 0.5) / thermal.CELLS
        states = thermal.integrate(thermal.slab_laplacian(thermal.CELLS, 300.0), np.zeros((thermal.CELLS, 1)),
                                   np.zeros((301, 1)), np.cos(np.pi * depth), 1.0)
        # finite differences slow the mode by (pi/20)²/12 = 0.2 %, so exp(-1) changes by 0.2 %
        self.assertAlmostEqual(states[300, 0] / states[0, 0], np.exp(-1), delta=0.003 * np.exp(-1))

    def test_gyro_settles_at_the_air_with_the_board_above_the_case_by_its_rise(self):
        body = thermal.ThermalBody(inner_leak=0.0)
        air, powered = np.full(20000, 25.0), np.ones(20000, dtype=bool)
        temperatures = thermal.solve(body, air, powered)
        jacobian, sources, _ = thermal.body_equations(body)
        steady = np.linalg.solve(jacobian, -sources @ [25.0, 1.0])
        # slowest time constant below 2000 s: exp(-10) of some 10 °C
        self.assertAlmostEqual(temperatures.board[-1], steady[-1], delta=1e-3)
        self.assertAlmostEqual(steady[-1] - steady[0], body.board_rise_degc, delta=1e-9)
        self.assertLess(np.ptp(temperatures.coil[-1]), 1e-3)

    def test_heat_only_moves_between_the_bodies(self):
        body = thermal.draw_body(np.random.default_rng(1))
        jacobian, sources, capacity = thermal.body_equations(body)
        exchange = capacity @ jacobian
        exchange[0] += capacity[0] / body.case_s  # what goes to the chamber
        self.assertLess(np.abs(exchange).max(), 1e-12)
        self.assertLess(np.abs(jacobian @ np.ones(len(capacity)) + sources[:, 0]).max(), 1e-12)

    def test_hub_lags_a_ramp_by_its_length_squared_over_three_diffusivities(self):
        # slab behind a face: mean lags a ramp by L²/(3 alpha) = pi²/12 of the slowest time constant
        face = np.arange(20000) / 60.0
        lag = (face - thermal.hub_mean(face, 600.0))[19990] * 60.0  # a step of its own grid
        self.assertAlmostEqual(lag, np.pi**2 / 12 * 600, delta=0.01 * 600)

    def test_thermometer_lag_is_first_order(self):
        step = np.concatenate([np.zeros(1), np.ones(100)])
        self.assertAlmostEqual(thermal.first_order_lag(step, 20.0)[20], 1 - np.exp(-1), delta=1e-12)


class Noise(unittest.TestCase):
    def test_cosine_transform_keeps_the_norm(self):
        x = np.random.default_rng(2).standard_normal((3, 600))
        c = noise.cosine_transform(x)
        np.testing.assert_allclose(np.sum(c**2, axis=1), np.sum(x**2, axis=1), rtol=1e-12)

    def test_cosine_transform_of_a_cosine_is_one_coefficient(self):
        n, k = 400, 7
        c = noise.cosine_transform(np.cos(np.pi * k * (np.arange(n) + 0.5) / n))
        self.assertAlmostEqual(c[k], np.sqrt(n / 2), delta=1e-9)
        self.assertLess(np.abs(np.delete(c, k)).max(), 1e-9)

    def check_spectrum(self, make, density, bands=((1, 10), (10, 100), (100, 1000), (1000, 1999)), tolerance=0.1):
        rng = np.random.default_rng(3)
        n, runs = 2000, 300
        power = np.mean([noise.cosine_transform(make(n, rng))**2 for _ in range(runs)], axis=0)[1:]
        f = noise.cosine_frequencies(n)
        ratio = power / density(f)
        for low, high in bands:
            # mean of (high-low) * 300 values of variance 2: at most 4 % for 9 cosines; leakage of steep spectra adds
            self.assertAlmostEqual(np.mean(ratio[low:high]), 1.0, delta=tolerance)

    def test_white_noise_has_its_spectrum(self):
        levels = noise.NoiseLevels(n_deg_per_sqrt_h=2e-3)
        self.check_spectrum(lambda n, rng: noise.synthesise_levels(n, levels, rng), lambda f: noise.density(levels, f))

    def test_flicker_noise_has_its_spectrum(self):
        self.check_spectrum(lambda n, rng: noise.synthesise(n, noise.flicker_density, rng), noise.flicker_density,
                            tolerance=0.15)

    def test_random_walk_has_its_spectrum(self):
        # the series ends at Nyquist: without its aliases it falls short up there, where white noise is 1e5 times larger
        self.check_spectrum(lambda n, rng: noise.wiener(n, 1.0, rng), noise.walk_density,
                            bands=((3, 10), (10, 100), (100, 500)), tolerance=0.15)

    def test_random_walk_starts_at_zero_and_spreads_with_the_root_of_time(self):
        rng = np.random.default_rng(4)
        ends = np.array([noise.wiener(3600, 0.05, rng)[[0, 1800, 3599]] for _ in range(2000)])
        self.assertLess(np.abs(ends[:, 0]).max(), 1e-12)
        # deviation of a deviation: 1/sqrt(2 * 2000) = 1.6 %, five of them
        self.assertAlmostEqual(ends[:, 1].std() / (0.05 * np.sqrt(0.5)), 1.0, delta=0.08)
        self.assertAlmostEqual(ends[:, 2].std() / 0.05, 1.0, delta=0.08)

    def test_counting_whole_steps_gives_the_rounding_spectrum(self):
        def make(n, rng):
            counts = np.floor(np.cumsum(3.3 + 0.7 * rng.standard_normal(n + 1)) / 0.5)
            return np.diff(counts) * 0.5

        def density(f):
            return 0.25 * noise.rounding_density(f) + 0.49
        self.check_spectrum(make, density)

    def test_mixture_that_holds_the_truth_leaves_no_likelihood_gain(self):
        f = noise.cosine_frequencies(18000)
        parts = [noise.white_density(f), noise.flicker_density(f), noise.walk_density(f)]
        truth = 1e-6 * parts[0] + 1e-4 * parts[1] + 1e-4 * parts[2]
        self.assertLess(noise.log_likelihood_gain(truth, parts, rounds=4000), 1e-2)
        self.assertGreater(noise.log_likelihood_gain(truth + 1e-3 * noise.lorentz_density(f, 60.0), parts), 10)


class Strength(unittest.TestCase):
    def test_d_in_white_noise_is_the_root_of_the_sum_of_squares_over_sigma(self):
        n, sigma = 1200, 0.3
        wave = np.random.default_rng(5).standard_normal(n)
        wave -= wave.mean()
        whitener = noise.Whitener(np.full(n - 1, sigma**2))
        self.assertAlmostEqual(whitener.distance(wave, whitener.basis([])), np.sqrt(np.sum(wave**2)) / sigma,
                               delta=1e-9)

    def test_a_mean_has_no_strength(self):
        whitener = noise.Whitener(np.ones(599))
        self.assertLess(whitener.distance(np.full(600, 7.0), whitener.basis([])), 1e-9)

    def test_what_the_model_has_already_has_no_strength(self):
        rng = np.random.default_rng(6)
        columns = rng.standard_normal((3, 900)) * [[1.0], [1e-6], [1e5]]
        whitener = noise.Whitener(1.0 + 1.0 / np.arange(1, 900))
        wave = np.array([2.0, -3e6, 1e-5]) @ columns + 4.0
        self.assertLess(whitener.distance(wave, whitener.basis(list(columns))), 1e-8)

    def test_whitened_noise_of_the_levels_has_variance_one(self):
        levels = noise.NoiseLevels(2e-3, 2e-2, 2e-2)
        rng, n = np.random.default_rng(7), 4000
        whitener = noise.Whitener(noise.density(levels, noise.cosine_frequencies(n)))
        white = np.array([whitener.whiten(noise.synthesise_levels(n, levels, rng)) for _ in range(40)])
        # 4000 * 40 values: 5 sigma of the variance is 5 sqrt(2 / 160000) = 1.8 %; leakage into low cosines 2 %
        self.assertAlmostEqual(np.mean(white**2), 1.0, delta=0.04)


class Effects(unittest.TestCase):
    def setUp(self):
        rng = np.random.default_rng(8)
        inputs = profiles.draw_inputs(rng, 0, 40, n=6000)
        self.scene = effects.Scene(inputs, thermal.solve(thermal.draw_body(rng), inputs.air_degc, inputs.powered), rng)

    def test_dwell_times_of_the_telegraph_are_exponential(self):
        out = effects.switching(np.random.default_rng(9), 4_000_000, 400.0, 100.0)
        edges = np.flatnonzero(np.diff(out))
        lengths, level = np.diff(edges), out[edges[:-1] + 1]
        for sign, mean in ((0.5, 400.0), (-0.5, 100.0)):
            held = lengths[level == sign]
            # some 8000 dwells: 5 sigma of the mean is 5.6 %; rounding up adds half a second
            self.assertAlmostEqual(held.mean(), mean + 0.5, delta=0.056 * mean)
            self.assertAlmostEqual(held.std() / held.mean(), 1.0, delta=0.08)
            # memoryless: of those beyond the mean, exp(-1) reach twice the mean; 5 sigma of 3000
            beyond = np.count_nonzero(held > 2 * mean) / np.count_nonzero(held > mean)
            self.assertAlmostEqual(beyond, np.exp(-1), delta=0.045)

    def test_relays_make_a_loop_that_does_not_depend_on_speed_and_closes(self):
        up_down = np.concatenate([np.linspace(0, 40, 400), np.linspace(40, 0, 400)] * 2)
        rng = np.random.default_rng(10)
        centre, coercivity = rng.uniform(5, 35, 300), rng.uniform(0, 6, 300)
        once = effects.preisach(up_down, centre, coercivity, np.full(300, 1 / 300))
        slow = effects.preisach(np.repeat(up_down, 3), centre, coercivity, np.full(300, 1 / 300))
        np.testing.assert_array_equal(once, slow[2::3])
        np.testing.assert_array_equal(once[400:800], once[1200:])
        self.assertGreater(once[600] - once[200], 0.05)

    def test_every_effect_is_finite_and_the_same_when_asked_again(self):
        for name in list(effects.WAVEFORMS) + list(effects.UNKNOWNS):
            with self.subTest(name):
                effect = effects.draw(name, np.random.default_rng(11), ["coil_outer", "coil_inner", "board"])
                size = 1.0 if effect.linear else 1e-4
                wave = effect.wave(self.scene, size)
                self.assertEqual(wave.shape, (6000,))
                self.assertTrue(np.all(np.isfinite(wave)))
                self.assertGreater(np.std(wave), 0)
                np.testing.assert_array_equal(wave, effect.wave(self.scene, size))

    def test_linear_effects_are_proportional_to_their_size(self):
        for name in list(effects.WAVEFORMS) + list(effects.UNKNOWNS):
            effect = effects.draw(name, np.random.default_rng(12), ["coil_outer", "coil_inner", "board"])
            if effect.linear:
                with self.subTest(name):
                    np.testing.assert_allclose(effect.wave(self.scene, -2.5), -2.5 * effect.wave(self.scene, 1.0))

    def test_dead_band_swallows_slow_rates_and_forgives_fast_ones(self):
        effect = effects.draw("dead_band", np.random.default_rng(13), [])
        shown = self.scene.rate + effect.wave(self.scene, 2.0)
        slow, fast = np.abs(self.scene.rate) < 2.0, np.abs(self.scene.rate) > 1000
        self.assertTrue(np.all(shown[slow] == 0))
        # w - sqrt(w² - 4) = 2/w
        self.assertLess(np.abs(shown - self.scene.rate)[fast].max(), 2.1e-3)

    def test_temperature_gradient_effect_vanishes_in_an_even_coil(self):
        even = thermal.Temperatures(np.full((6000, thermal.CELLS), 31.0), np.full(6000, 35.0))
        scene = effects.Scene(self.scene.inputs, even, self.scene.rng)
        for name in ("gradient", "gradient_rate", "shupe", "coil_lag"):
            effect = effects.draw(name, np.random.default_rng(14), [])
            self.assertLess(np.abs(effect.wave(scene, 1.0)).max(), 1e-9)


if __name__ == "__main__":
    unittest.main()
