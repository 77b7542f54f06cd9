"""Policies as ONNX graphs, run by ONNX Runtime, and graphs as policies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from standins import GRU, LSTM, Linear, ReLU, Tanh

from offtrack_sim import Policy, export
from offtrack_sim.export import Network

# Both come with tests/requirements.txt.
onnx = pytest.importorskip("onnx")
runtime = pytest.importorskip("onnxruntime")

LAYERS: dict[str, list[Any]] = {
    "perceptron": [Linear(69, 16, 1), ReLU(), Linear(16, 9, 2)],
    "tanh": [Linear(69, 16, 1), Tanh(), Linear(16, 8, 2), Tanh(), Linear(8, 9, 3)],
    "gru": [Linear(69, 12, 1), ReLU(), GRU(12, 7, 2), Linear(7, 9, 3)],
    "lstm": [LSTM(69, 7, 1, num_layers=2), Linear(7, 8, 2), Tanh(), Linear(8, 9, 3)],
}


def saved(tmp_path: Path, model: Any, **given: Any) -> Policy:
    file = tmp_path / "policy.safetensors"
    export.save(file, model, **given)
    return Policy.load(file)


def session(file: Path) -> Any:
    return runtime.InferenceSession(str(file), providers=["CPUExecutionProvider"])


def equal(one: Network, other: Network) -> bool:
    """Whether two networks have the same numbers; the graph does not know frames and names of values."""
    parts = [[*net.layers, *(layer for cell in net.cells for layer in cell)] for net in (one, other)]
    shapes = [(net.activation, net.squash, net.gates, net.after, len(net.layers)) for net in (one, other)]
    return shapes[0] == shapes[1] and all((mine == its).all() for pair in zip(*parts) for mine, its in zip(*pair))


@pytest.mark.parametrize("name", LAYERS)
def test_a_graph_that_was_written_drives_as_its_policy_and_is_read_as_its_network(name: str, tmp_path: Path) -> None:
    mean, variance = np.linspace(-0.2, 0.2, 69), np.linspace(0.5, 2, 69)
    policy = saved(tmp_path, LAYERS[name], mean=mean, variance=variance)
    file = tmp_path / "policy.onnx"
    export.to_onnx(policy, file)
    runs, n = session(file), 20
    driver, random = policy.driver(n), np.random.default_rng(0)
    states = {edge.name: np.zeros([1, n, edge.shape[2]], np.float32) for edge in runs.get_inputs()[1:]}
    names = [edge.name for edge in runs.get_outputs()]
    taken = set()
    for _ in range(6):
        rows = random.normal(size=(n, 69)).astype(np.float32)
        outputs = dict(zip(names, runs.run(None, {"observation": rows, **states})))
        states = {state: outputs[f"next_{state}"] for state in states}
        actions = driver.act(rows)
        chosen = np.take_along_axis(outputs["output"], actions[:, None], 1)[:, 0]
        # The runtime sums in another order.
        assert (outputs["output"].max(1) - chosen < 1e-5).all()
        if not policy.has_memory:
            assert policy.logits(rows) == pytest.approx(outputs["output"], abs=1e-5)
        taken.update(actions.tolist())
    assert len(taken) > 2 and len(states) == {"gru": 1, "lstm": 4}.get(name, 0)
    found = export.from_onnx(file)
    assert equal(found, export.network(policy))
    assert saved(tmp_path, found).logits(rows).tolist() == policy.logits(rows).tolist() if not states else True


@pytest.mark.parametrize("squash", ["tanh", "clip"])
def test_commands_and_stacks_of_frames_are_written_and_read(squash: str, tmp_path: Path) -> None:
    model = [Linear(26, 12, 1), ReLU(), Linear(12, 1, 2)]
    given: dict[str, Any] = {"values": ["tractor_range"], "frames": 2}
    policy = saved(tmp_path, model, squash=squash, mean=np.full(13, 0.5), variance=np.full(13, 0.1), **given)
    file = tmp_path / "policy.onnx"
    export.to_onnx(policy, file)
    rows = np.random.default_rng(1).random((50, 69)).astype(np.float32)
    driver = policy.driver(50)
    driver.act(rows)
    stacks = np.concatenate([rows[:, 46:59], rows[:, 46:59]], 1)
    (outputs,) = session(file).run(None, {"observation": stacks})
    assert driver.act(rows) == pytest.approx(outputs, abs=1e-5) and outputs.std() > 0.01
    found = export.from_onnx(file)
    again = saved(tmp_path, found, **given).driver(50)
    again.act(rows)
    assert again.act(rows) == pytest.approx(outputs, abs=1e-5)


def graph(*nodes: Any, constants: dict[str, Any]) -> Any:
    helper, kind = onnx.helper, onnx.TensorProto.FLOAT
    edges = [helper.make_tensor_value_info(name, kind, None) for name in ("x", "y")]
    tensors = [onnx.numpy_helper.from_array(np.asarray(value, np.float32), name) for name, value in constants.items()]
    return helper.make_model(helper.make_graph(list(nodes), "g", edges[:1], edges[1:], tensors))


def test_a_graph_as_other_exporters_write_it_is_read(tmp_path: Path) -> None:
    node, first, last = onnx.helper.make_node, LAYERS["perceptron"][0], LAYERS["perceptron"][2]
    file = tmp_path / "other.onnx"
    model = graph(
        node("Flatten", ["x"], ["flat"]),
        node("Transpose", ["w0"], ["w0t"], perm=[1, 0]),
        node("MatMul", ["flat", "w0t"], ["a"]),
        node("Add", ["b0", "a"], ["b"]),
        node("Relu", ["b"], ["c"]),
        node("Gemm", ["c", "w1", "b1"], ["d"], transB=1),
        node("Identity", ["d"], ["y"]),
        constants={"w0": first.weight, "b0": first.bias, "w1": last.weight, "b1": last.bias},
    )
    onnx.save(model, str(file))
    assert equal(export.from_onnx(file), export.network(saved(tmp_path, LAYERS["perceptron"])))


def test_a_recurrent_graph_over_time_is_read_as_one_of_a_step(tmp_path: Path) -> None:
    policy = saved(tmp_path, [GRU(69, 7, 1), Linear(7, 9, 2)])
    file, node = tmp_path / "other.onnx", onnx.helper.make_node
    export.to_onnx(policy, file)
    written = onnx.load(str(file)).graph
    weights = {tensor.name: onnx.numpy_helper.to_array(tensor) for tensor in written.initializer}
    weights = {name: value for name, value in weights.items() if value.dtype == np.float32}
    of = {one.op_type: list(one.input) for one in written.node}
    (w, r, b), (head, biases) = of["GRU"][1:4], of["Gemm"][1:3]
    model = graph(
        node("Unsqueeze", ["x", "zero"], ["steps"]),
        node("GRU", ["steps", w, r, b], ["all"], hidden_size=7, linear_before_reset=1),
        node("Squeeze", ["all", "one"], ["hidden"]),
        node("Gather", ["hidden", "last"], ["now"], axis=0),
        node("Gemm", ["now", head, biases], ["y"]),
        constants=weights,
    )
    integers = {"zero": [0], "one": [1], "last": -1}
    model.graph.initializer.extend(
        onnx.numpy_helper.from_array(np.array(value, np.int64), name) for name, value in integers.items()
    )
    onnx.save(model, str(file))
    assert equal(export.from_onnx(file), export.network(policy))


def test_what_an_lstm_remembers_is_not_taken_for_its_values(tmp_path: Path) -> None:
    policy, file = saved(tmp_path, LAYERS["lstm"]), tmp_path / "other.onnx"
    export.to_onnx(policy, file)
    model = onnx.load(str(file))
    squeeze = [node for node in model.graph.node if node.op_type == "Squeeze"][-1]
    squeeze.input[0] = squeeze.input[0].replace("hidden", "cell")
    onnx.save(model, str(file))
    with pytest.raises(TypeError, match="LSTM: its output 'next_cell_1' is used, for which a policy file has no place"):
        export.from_onnx(file)


@pytest.mark.parametrize(
    ("kind", "inputs", "more", "message"),
    [
        ("Sigmoid", ["x"], {}, "node 'y', Sigmoid: a policy file has no place for it; Gemm, MatMul, Add,"),
        ("Mul", ["x", "x"], {}, "both inputs are computed; a constant is needed beside what flows"),
        ("Gemm", ["x", "w"], {"alpha": 2.0}, "constant weights, alpha = beta = 1 and no transA are needed"),
        ("Relu", ["x"], {}, "it stands where a policy file has no place for it"),
        ("Sub", ["x", "b"], {}, "its last layer is no Gemm or MatMul"),
        ("GRU", ["x", "w3", "r3"], {"hidden_size": 1}, "linear_before_reset = 1 is needed, as PyTorch has it"),
        ("LSTM", ["x", "w4", "r4"], {"hidden_size": 1, "direction": "reverse"}, "one direction, forward, are needed"),
        ("LSTM", ["x", "w4", "r4"], {"hidden_size": 1}, "its last layer is no Gemm or MatMul"),
        ("LSTM", ["x", "w4", "r4", "", "", "h"], {"hidden_size": 1}, "its first hidden values are not 0"),
        ("MatMul", ["w", "x"], {}, "node 'y', MatMul: a policy file has no place for it"),
        ("Transpose", ["x"], {}, "it rounds, or moves values among each other"),
        ("Cast", ["x"], {"to": onnx.TensorProto.INT32}, "it rounds, or moves values among each other"),
        ("Cast", ["x"], {"to": onnx.TensorProto.BFLOAT16}, "it rounds, or moves values among each other"),
        ("Gather", ["x", "last"], {"axis": 1}, "node 'y', Gather: a policy file has no place for it"),
        ("ArgMax", ["x"], {"axis": 0}, "of each row is needed, so the last axis"),
        ("ArgMax", ["x"], {"axis": -2}, "of each row is needed, so the last axis"),
        ("ArgMax", ["x"], {}, "of each row is needed, so the last axis"),
        ("ArgMax", ["x"], {"axis": 1, "select_last_index": 1}, "the first of the largest values"),
    ],
)
def test_a_node_that_a_policy_file_has_no_place_for_is_refused_by_its_name(
    kind: str, inputs: list[str], more: dict[str, Any], message: str, tmp_path: Path
) -> None:
    constants = {"w": np.ones((69, 9)), "b": np.ones(9), "h": np.ones((1, 1, 1))}
    constants |= {f"{part}{n}": np.ones((1, n, 69 if part == "w" else 1)) for n in (3, 4) for part in "wr"}
    file = tmp_path / "other.onnx"
    model = graph(onnx.helper.make_node(kind, inputs, ["y"], **more), constants=constants)
    model.graph.initializer.append(onnx.numpy_helper.from_array(np.array(-1, np.int64), "last"))
    onnx.save(model, str(file))
    with pytest.raises(TypeError, match=message):
        export.from_onnx(file)


def test_a_graph_that_normalises_without_clipping_and_what_is_no_graph_are_refused(tmp_path: Path) -> None:
    file, node = tmp_path / "other.onnx", onnx.helper.make_node
    nodes = node("Div", ["x", "b"], ["a"]), node("MatMul", ["a", "w"], ["y"])
    onnx.save(graph(*nodes, constants={"w": np.ones((69, 9)), "b": np.full(69, 2.0)}), str(file))
    with pytest.raises(TypeError, match="it normalises without a Clip to -10..10"):
        export.from_onnx(file)
    clipped = {"w": np.ones((69, 9)), "b": np.full(69, 2.0), "low": np.float32(-10), "high": np.float32(10)}
    of_clipped = node("Mul", ["c", "b"], ["d"]), node("MatMul", ["d", "w"], ["y"])
    before = node("Sub", ["x", "b"], ["a"]), node("Clip", ["a", "low", "high"], ["c"])
    onnx.save(graph(*before, *of_clipped, constants=clipped), str(file))
    with pytest.raises(TypeError, match="node 'd', Mul: it stands where a policy file has no place for it"):
        export.from_onnx(file)
    file.write_bytes(b"no graph")
    with pytest.raises(ValueError, match="other.onnx: is no ONNX graph"):
        export.from_onnx(file)
    with pytest.raises(OSError, match="missing.onnx"):
        export.from_onnx(tmp_path / "missing.onnx")


@pytest.mark.filterwarnings("error")
def test_a_graph_with_numbers_beyond_float32_is_refused_without_a_warning(tmp_path: Path) -> None:
    for kind in ("MatMul", "Gemm"):
        model = graph(onnx.helper.make_node(kind, ["x", "w"], ["y"]), constants={})
        model.graph.initializer.append(onnx.numpy_helper.from_array(np.full((69, 9), 1e39), "w"))
        onnx.save(model, str(tmp_path / "huge.onnx"))
        with pytest.raises(ValueError, match="inf"):
            export.save(tmp_path / "policy.safetensors", export.from_onnx(tmp_path / "huge.onnx"))
