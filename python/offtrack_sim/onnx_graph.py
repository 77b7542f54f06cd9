"""Networks as ONNX graphs, written and read with the package ``onnx``.

Only what a policy file holds has a place in a graph here: a chain of layers with an activation, recurrent layers, and a
normalisation before them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .arguments import single
from .episodes import Floats
from .network import Layer, Network
from .trained import CLIP

#: ONNX's order of a layer's gates, by their places in PyTorch's: update, reset, new; input, output, forget, cell.
ORDER = {"gru": [1, 0, 2], "lstm": [0, 3, 1, 2]}
#: Nodes that change no number.
SHAPES = {"Cast", "Dropout", "Expand", "Flatten", "Identity", "Reshape", "Squeeze", "Transpose", "Unsqueeze"}
#: Operators of ONNX as of this version, which its runtimes have had since 2021.
OPSET = 14


def _onnx() -> Any:
    try:
        import onnx
        import onnx.numpy_helper
    except ImportError:
        raise ImportError("the package onnx is needed: pip install 'offtrack-sim[onnx]'") from None
    return onnx


class _Graph:
    """A graph as it is written."""

    def __init__(self, onnx: Any) -> None:
        self.onnx = onnx
        self.nodes: list[Any] = []
        self.constants: list[Any] = []
        self.inputs: list[Any] = []
        self.outputs: list[Any] = []

    def constant(self, values: Any, kind: Any = np.float32) -> str:
        name = f"constant_{len(self.constants)}"
        self.constants.append(self.onnx.numpy_helper.from_array(np.array(values, kind), name))
        return name

    def node(self, kind: str, *inputs: str, outputs: list[str] | None = None, **attributes: Any) -> str:
        outputs = outputs or [f"value_{len(self.nodes)}"]
        self.nodes.append(self.onnx.helper.make_node(kind, list(inputs), outputs, **attributes))
        return outputs[-1]

    def edge(self, edges: list[Any], name: str, shape: list[Any]) -> str:
        edges.append(self.onnx.helper.make_tensor_value_info(name, self.onnx.TensorProto.FLOAT, shape))
        return name

    def linear(self, value: str, layer: Layer) -> str:
        return self.node("Gemm", value, self.constant(layer[0]), self.constant(layer[1]))

    def cell(self, value: str, index: int, gates: str, cell: tuple[Layer, Layer]) -> str:
        """A recurrent layer, from ``[n, inputs]`` to ``[n, units]``."""
        n_units = len(cell[1][0])

        def ordered(part: Floats) -> Floats:
            """A vector or the columns of a matrix, gate by gate, in ONNX's order, gates first."""
            return np.concatenate([part.T[gate * n_units : (gate + 1) * n_units] for gate in ORDER[gates]])

        weights = [self.constant(ordered(layer[0])[None]) for layer in cell]
        biases = self.constant(np.concatenate([ordered(layer[1]) for layer in cell])[None])
        steps = self.node("Unsqueeze", value, self.constant([0], np.int64))
        kept = ["hidden", "cell"] if gates == "lstm" else ["hidden"]
        states = [self.edge(self.inputs, f"{name}_{index}", [1, "n", n_units]) for name in kept]
        following = [self.edge(self.outputs, f"next_{name}_{index}", [1, "n", n_units]) for name in kept]
        extra = {} if gates == "lstm" else {"linear_before_reset": 1}
        self.node(
            gates.upper(), steps, *weights, biases, "", *states, outputs=["", *following], hidden_size=n_units, **extra
        )
        return self.node("Squeeze", following[0], self.constant([0], np.int64))


def write(network: Network, file: str, name: str) -> None:
    """Writes a network as a graph."""
    onnx = _onnx()
    graph = _Graph(onnx)
    first = network.cells[0][0] if network.cells and network.after == 0 else network.layers[0]
    n_inputs = len(first[0])
    value = graph.edge(graph.inputs, "observation", ["n", n_inputs])
    if network.normalisation is not None:
        mean, factor = (np.tile(part, n_inputs // len(part)) for part in network.normalisation)
        value = graph.node("Mul", graph.node("Sub", value, graph.constant(mean)), graph.constant(factor))
        value = graph.node("Clip", value, graph.constant(-CLIP), graph.constant(CLIP))
    for index, layer in enumerate(network.layers):
        if network.gates is not None and index == network.after:
            for cell_index, cell in enumerate(network.cells):
                value = graph.cell(value, cell_index, network.gates, cell)
        value = graph.linear(value, layer)
        if index + 1 < len(network.layers):
            value = graph.node({"relu": "Relu", "tanh": "Tanh"}[network.activation], value)
    if network.squash == "tanh":
        value = graph.node("Tanh", value)
    if network.squash == "clip":
        value = graph.node("Clip", value, graph.constant(-1.0), graph.constant(1.0))
    graph.node("Identity", value, outputs=["output"])
    output: list[Any] = []
    graph.edge(output, "output", ["n", len(network.layers[-1][1])])
    whole = onnx.helper.make_graph(graph.nodes, "policy", graph.inputs, output + graph.outputs, graph.constants)
    # Version 8 of the format came with these operators' runtimes.
    model = onnx.helper.make_model(
        whole,
        opset_imports=[onnx.helper.make_opsetid("", OPSET)],
        ir_version=8,
        producer_name="offtrack",
        doc_string=name,
    )
    onnx.checker.check_model(model)
    Path(file).write_bytes(model.SerializeToString())


class _Reader:
    """Walks a graph from its output to its input, and remembers what it passes, last first."""

    def __init__(self, onnx: Any, graph: Any) -> None:
        self.onnx = onnx
        self.constants = {tensor.name: onnx.numpy_helper.to_array(tensor) for tensor in graph.initializer}
        self.producers = {name: node for node in graph.node for name in node.output if name}
        for node in graph.node:
            if node.op_type == "Constant":
                held = next((part for part in node.attribute if part.name == "value"), None)
                if held is not None:
                    self.constants[node.output[0]] = onnx.numpy_helper.to_array(held.t)
        # Inputs that are constants, too, are such.
        self.inputs = {edge.name for edge in graph.input} - set(self.constants)

    def constant(self, name: str) -> Any:
        """The values of a constant, passing over nodes that only change its shape; ``None`` for anything else."""
        while name not in self.constants:
            node = self.producers.get(name)
            if node is None or node.op_type not in ("Identity", "Transpose"):
                return None
            if node.op_type == "Transpose":
                inner = self.constant(node.input[0])
                return None if inner is None else np.transpose(inner, self.attribute(node, "perm"))
            name = node.input[0]
        return self.constants[name]

    def attribute(self, node: Any, name: str, default: Any = None) -> Any:
        held = next((part for part in node.attribute if part.name == name), None)
        return default if held is None else self.onnx.helper.get_attribute_value(held)

    def operands(self, node: Any) -> tuple[str, Any]:
        """What flows into a node of two inputs, and the constant that it meets; which of them comes first is free."""
        for value, other in (node.input[:2], node.input[1::-1]):
            constant = self.constant(other)
            if constant is not None:
                return value, single(np.asarray(constant))
        raise TypeError(f"{_named(node)}: both inputs are computed; a constant is needed beside what flows")


def _named(node: Any) -> str:
    return f"node {node.name or node.output[0]!r}, {node.op_type}"


def read(file: str) -> Network:
    """The network of a graph."""
    onnx = _onnx()
    try:
        # Weights that lie beside the file are read, too.
        model = onnx.load(file)
        graph = model.graph
        name = graph.output[0].name
    except OSError:
        raise
    except Exception as error:
        raise ValueError(f"{file}: is no ONNX graph: {error}") from None
    reader = _Reader(onnx, graph)
    passed: list[tuple[Any, str, Any]] = []
    while name not in reader.inputs:
        node = reader.producers.get(name)
        if node is None:
            raise TypeError(f"{file}: {name!r} comes from no input of the graph")
        # A recurrent layer's first two outputs are its values; an LSTM's third one is what it remembers.
        if name not in node.output[: 2 if node.op_type in ("GRU", "LSTM") else 1]:
            raise TypeError(f"{_named(node)}: its output {name!r} is used, for which a policy file has no place")
        name, found = _passed(reader, node)
        if found is not None:
            passed.append((node, *found))
    return _chained(file, passed[::-1])


def _passed(reader: _Reader, node: Any) -> tuple[str, tuple[str, Any] | None]:
    """The input that flows into a node, and what the node is: its kind and numbers, ``None`` where it changes none."""
    kind = node.op_type
    if kind in SHAPES and _changes_numbers(reader, node):
        raise TypeError(
            f"{_named(node)}: it rounds, or moves values among each other; a policy file has no place for it"
        )
    if kind in SHAPES or (kind == "Gather" and _is_one_step(reader, node)):
        return node.input[0], None
    if kind == "ArgMax":
        if reader.attribute(node, "axis", 0) not in (-1, 1, 2) or reader.attribute(node, "select_last_index", 0):
            raise TypeError(f"{_named(node)}: the first of the largest values of each row is needed, so the last axis")
        return node.input[0], None
    if kind in ("Relu", "Tanh"):
        return node.input[0], (kind, None)
    if kind in ("Add", "Mul"):
        value, constant = reader.operands(node)
        return value, (kind, constant)
    if kind in ("Sub", "Div", "MatMul"):
        constant = reader.constant(node.input[1])
        if constant is not None:
            return node.input[0], (kind, single(np.asarray(constant)))
    if kind == "Clip":
        bounds = [reader.constant(name) for name in node.input[1:3]]
        if len(bounds) < 2:
            bounds = [reader.attribute(node, name) for name in ("min", "max")]
        return node.input[0], (kind, tuple(None if bound is None else np.asarray(bound).item() for bound in bounds))
    if kind == "Gemm":
        return node.input[0], (kind, _gemm(reader, node))
    if kind in ("GRU", "LSTM"):
        return node.input[0], (kind, _recurrent(reader, node))
    raise TypeError(
        f"{_named(node)}: a policy file has no place for it; Gemm, MatMul, Add, Relu, Tanh, GRU and LSTM are read"
    )


def _changes_numbers(reader: _Reader, node: Any) -> bool:
    """Whether a node that seems to change no number does: one that rounds values, or turns rows into columns."""
    if node.op_type == "Cast":
        before = reader.producers.get(node.input[0])
        of_actions = before is not None and before.op_type == "ArgMax"
        types = reader.onnx.TensorProto
        return not of_actions and reader.attribute(node, "to") not in (types.FLOAT, types.DOUBLE)
    if node.op_type == "Transpose":
        order = reader.attribute(node, "perm")
        return order is None or order[-1] != len(order) - 1
    return False


def _is_one_step(reader: _Reader, node: Any) -> bool:
    """Whether a Gather takes the first or last step of what comes from a memory: a policy sees one step at a time."""
    index, axis = reader.constant(node.input[1]), reader.attribute(node, "axis", 0)
    if index is None or np.ndim(index) != 0 or int(index) not in (0, -1) or axis not in (0, 1):
        return False
    before = reader.producers.get(node.input[0])
    while before is not None and before.op_type not in ("GRU", "LSTM"):
        flows = [name for name in before.input if reader.constant(name) is None]
        before = reader.producers.get(flows[0]) if len(flows) == 1 else None
    return before is not None


def _gemm(reader: _Reader, node: Any) -> Layer:
    weights = reader.constant(node.input[1])
    n = len(node.input)
    biases = reader.constant(node.input[2]) if n > 2 else None
    plain = [reader.attribute(node, name, 1.0) == 1.0 for name in ("alpha", "beta")]
    if weights is None or (n > 2 and biases is None) or not all(plain) or reader.attribute(node, "transA", 0):
        raise TypeError(f"{_named(node)}: constant weights, alpha = beta = 1 and no transA are needed")
    weights = weights.T if reader.attribute(node, "transB", 0) else weights
    biases = np.zeros(weights.shape[1]) if biases is None else biases
    return np.ascontiguousarray(single(weights)), single(biases).reshape(-1)


def _recurrent(reader: _Reader, node: Any) -> tuple[Layer, Layer]:
    gates = node.op_type.lower()
    parts = [reader.constant(name) for name in node.input[1:4] if name]
    direction = reader.attribute(node, "direction", b"forward")
    others = ("activations", "clip", "input_forget")
    if any(part is None for part in parts) or len(parts) < 2 or direction != b"forward":
        raise TypeError(f"{_named(node)}: constant weights and one direction, forward, are needed")
    if any(reader.attribute(node, name) for name in others) or (len(node.input) > 7 and node.input[7]):
        raise TypeError(f"{_named(node)}: {', '.join(others)} and peepholes have no place in a policy file")
    if gates == "gru" and reader.attribute(node, "linear_before_reset", 0) != 1:
        raise TypeError(f"{_named(node)}: linear_before_reset = 1 is needed, as PyTorch has it")
    states = [reader.constant(name) for name in node.input[5:7] if name]
    if any(np.any(state) for state in states if state is not None):
        raise TypeError(f"{_named(node)}: its first hidden values are not 0, as a policy's are")
    n_units = parts[1].shape[-1]
    order = np.argsort(ORDER[gates])

    def ordered(part: Any) -> Floats:
        """Rows gate by gate, in PyTorch's order."""
        rows = np.concatenate([part[gate * n_units : (gate + 1) * n_units] for gate in order])
        return np.ascontiguousarray(single(rows.T))

    n_rows = len(order) * n_units
    biases = parts[2][0] if len(parts) > 2 else np.zeros(2 * n_rows)
    return (ordered(parts[0][0]), ordered(biases[:n_rows])), (ordered(parts[1][0]), ordered(biases[n_rows:]))


def _chained(file: str, passed: list[tuple[Any, str, Any]]) -> Network:
    """The network of what was passed, from the input on."""
    layers: list[Layer] = []
    cells: list[tuple[Layer, Layer]] = []
    activations: set[str] = set()
    mean: Any = None
    factor: Any = None
    gates, after, squash, last = None, 0, None, ""
    is_clipped = False

    def misplaced(node: Any) -> TypeError:
        return TypeError(f"{file}: {_named(node)}: it stands where a policy file has no place for it")

    for index, (node, kind, numbers) in enumerate(passed):
        is_end = index + 1 == len(passed)
        is_begin = not layers and not cells
        if squash is not None:
            raise misplaced(node)
        if is_begin and kind in ("Sub", "Add") and mean is None and factor is None:
            mean = numbers if kind == "Sub" else -numbers
        elif is_begin and kind in ("Mul", "Div") and factor is None and not is_clipped:
            factor = numbers if kind == "Mul" else 1 / numbers
        elif is_begin and kind == "Clip" and (mean is not None or factor is not None) and numbers == (-CLIP, CLIP):
            is_clipped = True
        elif kind == "Gemm" and last != "Linear":
            layers.append(numbers)
            last = "Linear"
        elif kind == "MatMul" and last != "Linear" and numbers.ndim == 2:
            layers.append((numbers, np.zeros(numbers.shape[1], np.float32)))
            last = "Linear"
        elif kind == "Add" and last == "Linear" and not layers[-1][1].any():
            weights = layers[-1][0]
            layers[-1] = weights, np.broadcast_to(numbers.reshape(-1), weights.shape[1]).astype(np.float32)
        elif kind in ("Relu", "Tanh") and last == "Linear":
            if is_end and kind == "Tanh":
                squash = "tanh"
            else:
                activations.add(kind.lower())
            last = "Activation"
        elif kind == "Clip" and last == "Linear" and numbers == (-1.0, 1.0):
            squash = "clip"
        elif kind in ("GRU", "LSTM") and last != "Linear" and (not cells or last == kind):
            if not cells:
                gates, after = kind.lower(), len(layers)
            cells.append(numbers)
            last = kind
        else:
            raise misplaced(node)
    if not layers or (last != "Linear" and squash is None):
        raise TypeError(
            f"{file}: its last layer is no Gemm or MatMul, whose outputs are the actions' values or commands"
        )
    if len(activations) > 1:
        raise TypeError(f"{file}: Relu and Tanh; a policy file has one activation for all of its layers")
    n_inputs = len((cells[0][0] if cells and after == 0 else layers[0])[0])
    normalisation = None
    if mean is not None or factor is not None:
        if not is_clipped:
            raise TypeError(f"{file}: it normalises without a Clip to -10..10; a policy file clips there")
        normalisation = _spread(mean, 0.0, n_inputs), _spread(factor, 1.0, n_inputs)
    activation = activations.pop() if activations else "relu"
    return Network(
        layers, activation, squash=squash, gates=gates, after=after, cells=cells, normalisation=normalisation
    )


def _spread(numbers: Any, default: float, n: int) -> Floats:
    return np.broadcast_to(np.float32(default) if numbers is None else numbers.reshape(-1), n).astype(np.float32)
