//! A single number that lies where the learner is: on the host, or in the memory of a device, where nobody waits for
//! it.

use burn::tensor::Tensor;

/// A number, with the few operations that the learner needs of it.
#[derive(Debug, Clone)]
pub(super) enum Scalar {
    /// A number on the host.
    Host(f32),
    /// A number on a device, `[1, 1]`, without gradients.
    Device(Box<Tensor<2>>),
}

impl Scalar {
    /// The number where it is at hand.
    pub(super) fn known(&self) -> Option<f32> {
        match self {
            Scalar::Host(value) => Some(*value),
            Scalar::Device(_) => None,
        }
    }

    /// The number; waits for a device.
    pub(super) fn read(&self) -> f32 {
        match self {
            Scalar::Host(value) => *value,
            Scalar::Device(tensor) => Tensor::clone(tensor).into_scalar(),
        }
    }

    /// `self + other`.
    pub(super) fn plus(&self, other: &Scalar) -> Scalar {
        self.with(other, |a, b| a + b, |a, b| a + b)
    }

    /// `self - other`.
    pub(super) fn minus(&self, other: &Scalar) -> Scalar {
        self.with(other, |a, b| a - b, |a, b| a - b)
    }

    /// `self * other`.
    pub(super) fn times(&self, other: &Scalar) -> Scalar {
        self.with(other, |a, b| a * b, |a, b| a * b)
    }

    /// `self / other`.
    pub(super) fn over(&self, other: &Scalar) -> Scalar {
        self.with(other, |a, b| a / b, |a, b| a / b)
    }

    /// `self + number`.
    pub(super) fn plus_number(&self, number: f32) -> Scalar {
        self.map(|a| a + number, |a| a.add_scalar(number))
    }

    /// `self * number`.
    pub(super) fn times_number(&self, number: f32) -> Scalar {
        self.map(|a| a * number, |a| a.mul_scalar(number))
    }

    /// `self / number`.
    pub(super) fn over_number(&self, number: f32) -> Scalar {
        self.map(|a| a / number, |a| a.div_scalar(number))
    }

    pub(super) fn exp(&self) -> Scalar {
        self.map(f32::exp, Tensor::exp)
    }

    pub(super) fn sqrt(&self) -> Scalar {
        self.map(f32::sqrt, Tensor::sqrt)
    }

    fn map(&self, host: impl FnOnce(f32) -> f32, device: impl FnOnce(Tensor<2>) -> Tensor<2>) -> Scalar {
        match self {
            Scalar::Host(value) => Scalar::Host(host(*value)),
            Scalar::Device(tensor) => Scalar::Device(Box::new(device(Tensor::clone(tensor)))),
        }
    }

    fn with(&self, other: &Scalar, host: fn(f32, f32) -> f32, device: fn(Tensor<2>, Tensor<2>) -> Tensor<2>) -> Scalar {
        let on = |value: f32, like: &Tensor<2>| like.zeros_like().add_scalar(value);
        match (self, other) {
            (Scalar::Host(a), Scalar::Host(b)) => Scalar::Host(host(*a, *b)),
            (Scalar::Device(a), Scalar::Device(b)) => {
                Scalar::Device(Box::new(device(Tensor::clone(a), Tensor::clone(b))))
            }
            (Scalar::Host(a), Scalar::Device(b)) => Scalar::Device(Box::new(device(on(*a, b), Tensor::clone(b)))),
            (Scalar::Device(a), Scalar::Host(b)) => Scalar::Device(Box::new(device(Tensor::clone(a), on(*b, a)))),
        }
    }
}
