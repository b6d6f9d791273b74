//! A tree of boxes over triangles, for the closest point.

use nalgebra::Vector3;

use super::wall::Triangle;

/// Triangles in a leaf.
const LEAF: usize = 4;

#[derive(Clone, Copy, Debug)]
struct Aabb {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Aabb {
    const EMPTY: Aabb = Aabb {
        low: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
        high: Vector3::new(f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY),
    };

    fn with(self, point: &Vector3<f64>) -> Self {
        Self { low: self.low.inf(point), high: self.high.sup(point) }
    }

    fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|k| self.low[k] <= other.high[k] && self.high[k] >= other.low[k])
    }

    fn distance_squared(&self, p: &Vector3<f64>) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            let outside = (self.low[axis] - p[axis]).max(p[axis] - self.high[axis]).max(0.0);
            sum += outside * outside;
        }
        sum
    }
}

/// The left child follows its parent; a leaf has `count > 0` triangles from `first`.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// First entry of `order` for a leaf; right child otherwise.
    first: u32,
    count: u32,
}

/// Closest point on a triangle, with its barycentric coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closest {
    pub triangle: usize,
    pub point: Vector3<f64>,
    pub barycentric: [f64; 3],
    pub distance_squared: f64,
}

/// The tree.
#[derive(Clone, Debug)]
pub struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
    triangles: Vec<Triangle>,
}

impl Bvh {
    /// Builds the tree, splitting at the median of the centroids along the longest side.
    pub fn new(triangles: Vec<Triangle>) -> Self {
        let centroids: Vec<_> = triangles.iter().map(|t| (t[0] + t[1] + t[2]) / 3.0).collect();
        let order = (0..triangles.len() as u32).collect();
        let mut bvh = Self { nodes: Vec::new(), order, triangles };
        bvh.split(&centroids, 0, bvh.order.len());
        bvh.triangles = bvh.order.iter().map(|&k| bvh.triangles[k as usize]).collect();
        bvh
    }

    fn split(&mut self, centroids: &[Vector3<f64>], first: usize, end: usize) {
        let (mut bounds, mut centres) = (Aabb::EMPTY, Aabb::EMPTY);
        for &k in &self.order[first..end] {
            for corner in &self.triangles[k as usize] {
                bounds = bounds.with(corner);
            }
            centres = centres.with(&centroids[k as usize]);
        }
        let index = self.nodes.len();
        let count = end - first;
        self.nodes.push(Node { bounds, first: first as u32, count: count as u32 });
        if count <= LEAF {
            return;
        }
        let axis = (centres.high - centres.low).imax();
        let middle = count / 2;
        self.order[first..end].select_nth_unstable_by(middle, |&a, &b| {
            centroids[a as usize][axis].total_cmp(&centroids[b as usize][axis])
        });
        self.split(centroids, first, first + middle);
        let right = self.nodes.len() as u32;
        self.split(centroids, first + middle, end);
        self.nodes[index].first = right;
        self.nodes[index].count = 0;
    }

    /// Adds the triangles whose boxes overlap that of a triangle.
    pub(crate) fn overlapping(&self, triangle: &Triangle, found: &mut Vec<usize>) {
        let own = triangle.iter().fold(Aabb::EMPTY, |bounds, corner| bounds.with(corner));
        let mut stack = vec![0_u32];
        while let Some(index) = stack.pop() {
            let Some(node) =
                self.nodes.get(index as usize).filter(|node| node.bounds.overlaps(&own))
            else {
                continue;
            };
            if node.count == 0 {
                stack.extend([index + 1, node.first]);
                continue;
            }
            for at in node.first as usize..(node.first + node.count) as usize {
                let other = self.triangles[at]
                    .iter()
                    .fold(Aabb::EMPTY, |bounds, corner| bounds.with(corner));
                if other.overlaps(&own) {
                    found.push(self.order[at] as usize);
                }
            }
        }
    }

    /// The point of the surface closest to `p`.
    pub fn closest(&self, p: &Vector3<f64>) -> Closest {
        let mut best = Closest {
            triangle: 0,
            point: *p,
            barycentric: [1.0, 0.0, 0.0],
            distance_squared: f64::INFINITY,
        };
        // A level of the tree puts one more on it than it takes, and 2³² triangles have 32 levels.
        let mut stack = [(0.0, 0_u32); 64];
        let mut waiting = 0;
        if let Some(root) = self.nodes.first() {
            stack[0] = (root.bounds.distance_squared(p), 0);
            waiting = 1;
        }
        while waiting > 0 {
            waiting -= 1;
            let (bound, index) = stack[waiting];
            if bound >= best.distance_squared {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.count > 0 {
                for at in node.first as usize..(node.first + node.count) as usize {
                    let (point, barycentric) = closest_on_triangle(p, &self.triangles[at]);
                    let distance_squared = (p - point).norm_squared();
                    if distance_squared < best.distance_squared {
                        let triangle = self.order[at] as usize;
                        best = Closest { triangle, point, barycentric, distance_squared };
                    }
                }
                continue;
            }
            let (left, right) = (index + 1, node.first);
            let left_bound = self.nodes[left as usize].bounds.distance_squared(p);
            let right_bound = self.nodes[right as usize].bounds.distance_squared(p);
            let (near, far) = if left_bound < right_bound {
                ((left_bound, left), (right_bound, right))
            } else {
                ((right_bound, right), (left_bound, left))
            };
            (stack[waiting], stack[waiting + 1]) = (far, near);
            waiting += 2;
        }
        best
    }
}

/// Closest point of a triangle and its barycentric coordinates, by the Voronoi regions of
/// its corners and edges. Source: Ericson, Real-Time Collision Detection (2005), §5.1.5.
fn closest_on_triangle(p: &Vector3<f64>, [a, b, c]: &Triangle) -> (Vector3<f64>, [f64; 3]) {
    let (ab, ac) = (b - a, c - a);
    let on_edge = |from: &Vector3<f64>, edge: &Vector3<f64>, share: f64| from + edge * share;

    let ap = p - a;
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let share = d1 / (d1 - d3);
        return (on_edge(a, &ab, share), [1.0 - share, share, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let share = d2 / (d2 - d6);
        return (on_edge(a, &ac, share), [1.0 - share, 0.0, share]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (on_edge(b, &(c - b), share), [0.0, 1.0 - share, share]);
    }
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    (a + ab * v + ac * w, [1.0 - v - w, v, w])
}
