use super::*;
use crate::device::{least, numbers};
use crate::network::Mlp;
use burn::tensor::{Tensor, TensorData};

#[test]
fn the_pass_of_many_trucks_is_the_networks_in_one_part_or_in_several() {
    let gpu = least();
    for (sizes, n_rows, most) in [
        (vec![6, 40, 33, 5], 70, MOST),
        // Four trucks at a time, the last time fewer.
        (vec![69, 16, 9], 11, ((69 + 1) * 16 + (16 + 1) * 9 + 4 * (69 + 9 + 2 * 16)) as u64 * NUMBER),
        (vec![3, 4], 40, MOST),
    ] {
        let network = Mlp::untrained(&sizes, 3);
        let (n_values, n_actions) = (sizes[0], sizes[sizes.len() - 1]);
        let seen: Vec<f32> = (0..n_rows * n_values).map(|n| ((n * 37 % 101) as f32 - 50.0) / 50.0).collect();
        let mut forward = Forward { most, ..Forward::new(&gpu, n_rows) };
        let on_device = gpu.filled("seen", cast_slice(&seen));
        let logits = gpu.empty("logits", (n_rows * n_actions) as u64 * NUMBER);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        forward.add(&mut encoder, &Network::of(&gpu, &network), &on_device, &logits);
        gpu.queue.submit([encoder.finish()]);
        let rows = forward.built.as_ref().map(|built| built.rows);
        assert_eq!(rows, Some(if most == MOST { n_rows } else { 4 }));
        let device = burn::tensor::Device::flex();
        let expected = network.forward(Tensor::from_data(TensorData::new(seen, [n_rows, n_values]), &device));
        let expected: Vec<f32> = expected.into_data().try_to_vec().unwrap();
        let found = numbers(&gpu, &logits).unwrap();
        assert!(expected.iter().any(|value| 0.1 < value.abs()));
        for (n, (found, expected)) in found.iter().zip(&expected).enumerate() {
            assert!((found - expected).abs() < 1e-4 * expected.abs().max(1.0), "{n}: {found} {expected}");
        }
    }
}
