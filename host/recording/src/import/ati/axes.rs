//! Which axis of the sensor points along which axis of the vessel frame.

/// For each axis of the vessel frame, the axis of the sensor and its sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisMap([(usize, i8); 3]);

impl AxisMap {
    /// The frames are the same.
    pub const SAME: Self = Self([(0, 1), (1, 1), (2, 1)]);

    /// From `+y,-x,+z`: the vessel's x is the sensor's y, its y the sensor's −x.
    pub fn parse(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no axis map: write three axes, e.g. `+y,-x,+z`");
        let axis = |word: &str| {
            let word = word.trim();
            let (sign, name) = match word.strip_prefix('-') {
                Some(name) => (-1, name),
                None => (1, word.strip_prefix('+').unwrap_or(word)),
            };
            let index = ["x", "y", "z"].iter().position(|axis| *axis == name)?;
            Some((index, sign))
        };
        let axes = text.split(',').map(axis).collect::<Option<Vec<_>>>().ok_or_else(wrong)?;
        let axes: [(usize, i8); 3] = axes.try_into().map_err(|_| wrong())?;
        let all = (0..3).all(|k| axes.iter().any(|(index, _)| *index == k));
        if all { Ok(Self(axes)) } else { Err(wrong()) }
    }

    /// Whether it is a rotation. A map with a reflection is right only for a sensor that reports the
    /// reaction force.
    pub fn is_rotation(self) -> bool {
        let [a, b, c] = self.0.map(|(index, _)| index);
        let even = matches!([a, b, c], [0, 1, 2] | [1, 2, 0] | [2, 0, 1]);
        let sign: i8 = self.0.iter().map(|(_, sign)| sign).product();
        even == (sign > 0)
    }

    /// For each axis of the vessel frame, the sensor's axis and its sign.
    pub fn signed(self) -> [(usize, f64); 3] {
        self.0.map(|(index, sign)| (index, f64::from(sign)))
    }

    pub(crate) fn apply(self, sensor: [f64; 3]) -> [f64; 3] {
        self.signed().map(|(index, sign)| sign * sensor[index])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_map_names_each_axis_once() {
        for (text, rotation) in [("x,y,z", true), ("+y,-x,+z", true), ("-x,-y,-z", false)] {
            assert_eq!(AxisMap::parse(text).unwrap().is_rotation(), rotation, "{text}");
        }
        assert!(!AxisMap::parse("y,x,z").unwrap().is_rotation());
        for text in ["", "x,y", "x,y,y", "x,y,w", "x,y,z,x"] {
            assert!(AxisMap::parse(text).unwrap_err().contains("+y,-x,+z"), "{text}");
        }
    }
}
