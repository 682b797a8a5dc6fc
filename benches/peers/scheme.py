"""bondline's scheme in the array language of NumPy and JAX: the linearly implicit pair of src/physics/step.rs.

Cells run along the last axis, after any number of member axes (none under `vmap`). `xp` is numpy or jax.numpy. `solver`
maps lower, diagonal and upper coefficients to a function from right-hand sides to solutions. The code follows the
conduction and faces of src/physics, without the heat balance.
"""

from layup import STEFAN_BOLTZMANN

GAMMA = 1 - 0.5**0.5


class Scheme:
    def __init__(self, layup, xp, solver, put):
        self.layup, self.xp, self.solver, self.put = layup, xp, solver, put

    def step(self, temperature_k, columns, length_s, flux_w_m2, surroundings_k):
        """Temperatures at the end of a step and sensor readings at its start; drives are (start, end) of the step."""
        k, capacity, slope = self.properties(columns, temperature_k, sloped=True)
        conductance, drop = self.conductances(k), temperature_k[..., :-1] - temperature_k[..., 1:]
        shown = self.readings(temperature_k, k, conductance, drop)
        hot, hot_slope, hot_end = self.hot_face(columns, temperature_k[..., 0], flux_w_m2, surroundings_k)
        driven = GAMMA * (hot_end - hot)

        by_upper, by_lower = self.flux_slopes(k, slope, conductance, drop)
        per_length = capacity / length_s
        diagonal = per_length + GAMMA * self.gathered(-hot_slope, by_lower, by_upper)
        solve = self.solver(-GAMMA * by_upper, diagonal, -GAMMA * by_lower)
        first = solve(self.imbalance(hot + driven, conductance * drop))

        staged_k = temperature_k + first
        k, capacity_staged = self.properties(columns, staged_k, sloped=False)
        flux = self.conductances(k) * (staged_k[..., :-1] - staged_k[..., 1:])
        _, _, hot_end = self.hot_face(columns, staged_k[..., 0], flux_w_m2, surroundings_k)
        side = capacity / capacity_staged * self.imbalance(hot_end, flux) - 2 * per_length * first
        second = solve(self.put(side, 0, side[..., 0] - driven))
        return temperature_k + 1.5 * first + 0.5 * second, shown

    def shown(self, temperature_k, columns):
        """Sensor readings."""
        k, _ = self.properties(columns, temperature_k, sloped=False)
        return self.readings(temperature_k, k, self.conductances(k), temperature_k[..., :-1] - temperature_k[..., 1:])

    def read(self, table, rises, temperature_k):
        """A function from columns of a table to their values at a temperature: straight lines between nodes."""
        xp = self.xp
        position = temperature_k * (1 / self.layup.table_step_k)
        row = position.astype(int)
        share = position - row
        take = lambda column: xp.take(column, row, mode="clip")
        return lambda column: take(xp.asarray(table[column])) + share * take(xp.asarray(rises[column]))

    def properties(self, columns, temperature_k, sloped):
        """Conductivity, areal heat capacity and, if `sloped`, the slope of the conductivity of each cell."""
        layup, found = self.layup, []
        for stretch in layup.stretches:
            scale = lambda column: columns[..., column, None]
            value = self.read(stretch.table, stretch.rises, temperature_k[..., stretch.start : stretch.end])
            parts = [value(0), value(1)] if sloped else [value(0)]
            if stretch.radiates:
                parts = [part + value(3 + i) / scale(stretch.extinction) for i, part in enumerate(parts)]
            k, *slope = [scale(stretch.conductivity) * part for part in parts]
            density_kg_m3 = stretch.density_kg_m3 * scale(stretch.density) * scale(stretch.heat_capacity)
            found.append((k, density_kg_m3 * value(2) * layup.width_m[stretch.start : stretch.end], *slope))
        return [self.xp.concatenate(parts, axis=-1) for parts in zip(*found)]

    def conductances(self, k):
        """From each node to the next, W/m²/K: by the mean conductivity within a ply; two half cells and the contact in
        series across interfaces."""
        layup, across = self.layup, self.layup.interfaces
        above, below = k[..., across], k[..., across + 1]
        both = above * below
        series = both / (
            layup.below_m[across] * below + layup.above_m[across + 1] * above + layup.contacts_m2_k_w * both
        )
        return self.put((k[..., :-1] + k[..., 1:]) * layup.half_over_next_1_m, across, series)

    def flux_slopes(self, k, slope, conductance, drop):
        """Slopes of the flux from each node to the next: by the temperature of the one, and by that of the other less;
        never negative."""
        layup, xp, across = self.layup, self.xp, self.layup.interfaces
        within = xp.ones_like(drop) * layup.half_over_next_1_m
        gain = lambda k, length_m: self.put(within + 0.0, across, (conductance[..., across] / k) ** 2 * length_m)
        above, below = gain(k[..., across], layup.below_m[across]), gain(k[..., across + 1], layup.above_m[across + 1])
        by_upper = xp.maximum(conductance + above * slope[..., :-1] * drop, 0)
        return by_upper, xp.maximum(conductance - below * slope[..., 1:] * drop, 0)

    def hot_face(self, columns, temperature_k, flux_w_m2, surroundings_k):
        """Heat flux into the layup by the drive at the start, its slope by the temperature, and the flux by the drive
        at the end."""
        layup = self.layup
        value = self.read(layup.face, layup.face_rises, temperature_k)
        reduced = 1 - layup.hot_wall_kg_j * value(0)
        radiance = STEFAN_BOLTZMANN * columns[..., layup.emissivity] * value(2)
        square = temperature_k * temperature_k
        flux = lambda end: flux_w_m2[end] * reduced + radiance * (surroundings_k[end] ** 4 - square * square)
        return flux(0), -flux_w_m2[0] * layup.hot_wall_kg_j * value(1) - 4 * radiance * square * temperature_k, flux(1)

    def imbalance(self, hot, flux):
        """What flows into each cell from above, less what flows on; nothing passes the back."""
        ahead = [(0, 0)] * (flux.ndim - 1)
        return self.xp.concatenate([hot[..., None], flux], axis=-1) - self.xp.pad(flux, [*ahead, (0, 1)])

    def gathered(self, hot, by_lower, by_upper):
        """What the diagonal has of the slopes at the faces of each cell."""
        ahead = [(0, 0)] * (by_upper.ndim - 1)
        return self.xp.concatenate([hot[..., None], by_lower], axis=-1) + self.xp.pad(by_upper, [*ahead, (0, 1)])

    def readings(self, temperature_k, k, conductance, drop):
        """Temperature on the face between two nodes, of its upper and lower side as a sensor weighs them."""
        layup, at = self.layup, self.layup.places
        above_m, below_m = layup.sides
        flux, drop = conductance[..., at] * drop[..., at], drop[..., at]
        fall = flux * (above_m / k[..., at] - below_m / k[..., at + 1]) + layup.share_below * drop
        return temperature_k[..., at] - fall
