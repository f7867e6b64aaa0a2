//! Houses and towers, put together from the kit's parts in the frame of their group: x along the
//! front, +z to the street, y = 0 at street level.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Vec3, vec3};

use super::City;
use crate::generate::Rng;
use crate::generate::trig::sin_cos_f32;

const FLOOR_HEIGHT: f32 = 3.3;
const WINDOW_SPACING: f32 = 2.4;

/// A terraced house. Lengths in metres.
pub struct House {
    width: f32,
    depth: f32,
    floors: usize,
}

impl House {
    pub fn random(width: f32, depth: f32, rng: &mut Rng) -> Self {
        Self {
            width,
            depth,
            floors: 3 + rng.below(3),
        }
    }
}

/// A free-standing block with bands of windows all round.
pub struct Tower {
    width: f32,
    depth: f32,
    floors: usize,
}

impl Tower {
    /// Towers are highest round the plaza.
    pub fn random(width: f32, depth: f32, ring: usize, rng: &mut Rng) -> Self {
        Self {
            width,
            depth,
            floors: 10 + rng.below(20 / (ring + 1)),
        }
    }
}

impl City {
    /// Body, roof, chimneys, door, ledges, balconies, then the windows of the street and of the court.
    pub fn house(&mut self, house: &House, rng: &mut Rng) {
        let House {
            width,
            depth,
            floors,
        } = *house;
        let height = floors as f32 * FLOOR_HEIGHT;
        let (front, top) = (0.5 * depth, Vec3::Y * height);
        self.part(
            self.kit.walls[rng.below(self.kit.walls.len())],
            Vec3::ZERO,
            vec3(width, height, depth),
        );
        let roof_height = rng.within(2.5..4.5);
        if rng.chance(0.25) {
            self.part(self.kit.flat_roof, top, vec3(width, 0.4, depth + 0.6));
        } else {
            let roof = self.kit.roofs[usize::from(rng.chance(0.2))];
            self.part(roof, top, vec3(width, roof_height, depth + 0.6));
        }
        for _ in 0..1 + rng.below(2) {
            let x = rng.within(-0.4..0.4) * width;
            let size = vec3(0.8, roof_height + 0.8, 0.8);
            self.part(
                self.kit.chimney,
                top + vec3(x, 0.0, rng.within(-0.2..0.2) * depth),
                size,
            );
        }
        for floor in 1..floors {
            let y = floor as f32 * FLOOR_HEIGHT - 0.1;
            self.part(self.kit.ledge, vec3(0.0, y, front), vec3(width, 0.2, 0.3));
        }

        let columns = (width / WINDOW_SPACING).floor().max(1.0) as usize;
        let column = |i: usize| width * ((i as f32 + 0.5) / columns as f32 - 0.5);
        let door = rng.below(columns);
        self.part(
            self.kit.door,
            vec3(column(door), 0.15, front),
            vec3(1.2, 2.3, 0.1),
        );
        let balcony_column = rng.below(columns);
        if rng.chance(0.5) {
            for floor in 1..floors {
                let at = vec3(
                    column(balcony_column),
                    floor as f32 * FLOOR_HEIGHT + 0.2,
                    front,
                );
                self.part(self.kit.balcony, at, vec3(2.0, 1.1, 1.1));
            }
        }
        // Of all the windows of the house: it has one kind.
        let window = self.choose_window(2 * floors * columns - 1);
        let size = vec3(1.1, 1.7, 0.18);
        for floor in 0..floors {
            let y = floor as f32 * FLOOR_HEIGHT + 0.95;
            for i in 0..columns {
                if floor > 0 || i != door {
                    self.part(window, vec3(column(i), y, front + 0.02), size);
                }
                self.turned_part(window, vec3(column(i), y, -front - 0.02), PI, size);
            }
        }
    }

    /// Body, crown, spire, then a ledge and a window band per floor and side.
    pub fn tower(&mut self, tower: &Tower, rng: &mut Rng) {
        let Tower {
            width,
            depth,
            floors,
        } = *tower;
        let height = floors as f32 * FLOOR_HEIGHT;
        self.part(
            self.kit.walls[rng.below(self.kit.walls.len())],
            Vec3::ZERO,
            vec3(width, height, depth),
        );
        self.part(
            self.kit.flat_roof,
            Vec3::Y * height,
            vec3(width + 0.8, 0.8, depth + 0.8),
        );
        let spire = vec3(0.3 * depth, rng.within(4.0..16.0), 0.3 * depth);
        self.part(self.kit.spire, Vec3::Y * (height + 0.8), spire);
        let sides = [
            (0.0, width, depth),
            (FRAC_PI_2, depth, width),
            (PI, width, depth),
            (-FRAC_PI_2, depth, width),
        ];
        let window = self.choose_window(sides.len() * floors);
        for floor in 0..floors {
            let y = floor as f32 * FLOOR_HEIGHT;
            for (turn, side, across) in sides {
                let (sin, cos) = sin_cos_f32(turn);
                let outward = vec3(sin, 0.0, cos) * (0.5 * across + 0.02);
                let size = vec3(0.85 * side, 2.0, 0.25);
                self.turned_part(window, outward + Vec3::Y * (y + 0.8), turn, size);
            }
            if floor > 0 {
                let size = vec3(width + 0.3, 0.25, depth + 0.3);
                self.part(self.kit.ledge, Vec3::Y * (y - 0.12), size);
            }
        }
    }
}
