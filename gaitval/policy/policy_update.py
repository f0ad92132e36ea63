"""Gradients and steps of proximal policy optimisation for networks of two hidden layers, compiled.

They are those that stable-baselines3 and torch compute, to rounding
(`tests/policy/test_learner.py`, in double precision). Compiled, the many small operations of
a minibatch need no interpreter, and without its lock actor and critic really learn side by side.

The arrays of a `Network` are those of torch's parameters: what is written here, torch sees.
All functions take single or double precision.
"""

from typing import Any, Final, NamedTuple

import numpy as np

from gaitval._internal.numba.compiled import njit_unlocked
from gaitval._internal.numba.lanes import exponential
from gaitval.arrays import Index

_Numbers = Any
"""An array in single or double precision."""


class Network(NamedTuple):
    """Weights (outputs, inputs) and biases (outputs,) of three layers, tanh after the first two;
    or their gradients, or their running means or mean squares. `first` takes the observation and
    `last` gives the output.
    """

    first: _Numbers
    first_bias: _Numbers
    second: _Numbers
    second_bias: _Numbers
    last: _Numbers
    last_bias: _Numbers


class Layers(NamedTuple):
    """Values of the layers for a minibatch of n rows: inputs (n, size), activations of the hidden
    layers `first` and `second` (n, units), and the output (n, outputs).

    `to_first`, `to_second` and `to_output` are the loss's derivatives with respect to these.
    """

    inputs: _Numbers
    first: _Numbers
    second: _Numbers
    output: _Numbers
    to_first: _Numbers
    to_second: _Numbers
    to_output: _Numbers


def layers_of(network: Network, rows: int) -> Layers:
    """Arrays for minibatches of so many `rows`, with the sizes and the precision of `network`."""
    kind = network.first.dtype
    units, size = network.first.shape
    outputs = len(network.last)
    widths = (size, units, units, outputs, units, units, outputs)
    return Layers(*(np.empty((rows, width), kind) for width in widths))


_ODD: Final = tuple(
    map(
        np.float32,
        (
            *(4.89352455891786e-03, 6.37261928875436e-04, 1.48572235717979e-05),
            *(5.12229709037114e-08, -8.60467152213735e-11, 2.00018790482477e-13),
            -2.76076847742355e-16,
        ),
    )
)
_EVEN: Final = tuple(
    map(
        np.float32,
        (4.89352518554385e-03, 2.26843463243900e-03, 1.18534705686654e-04, 1.19825839466702e-06),
    )
)
_FLAT: Final = np.float32(7.905311)
"""tanh of single precision as x P(x²) / Q(x²), the approximation that Eigen's `ptanh` has; beyond
`_FLAT` it is 1. Its error is below six units in the last place (tested)."""


@njit_unlocked
def _tanh(values: _Numbers) -> None:
    """Of every number, in place."""
    flat = values.ravel()
    # Single precision has the approximation above; double precision, which the tests compare with
    # torch, the formula itself.
    if flat.itemsize == 4:
        for i in range(flat.size):
            x = min(max(np.float32(flat[i]), -_FLAT), _FLAT)
            z = x * x
            a, b, c, d, e, f, g = _ODD  # written out, or it would not become vectors
            # Horner's scheme in z = x²: numerator x P(z), odd, and denominator Q(z), even, as tanh
            # is odd.
            odd = ((((((g * z + f) * z + e) * z + d) * z + c) * z) + b) * z + a
            a, b, c, d = _EVEN
            flat[i] = x * odd / (((d * z + c) * z + b) * z + a)
    else:
        for i in range(flat.size):
            # tanh x = (e²ˣ - 1) / (e²ˣ + 1); `exponential` is bounded, so the quotient is never ∞ /
            # ∞.
            power = exponential(2.0 * np.float64(flat[i]))
            flat[i] = (power - 1.0) / (power + 1.0)


@njit_unlocked
def _layer(inputs: _Numbers, weights: _Numbers, bias: _Numbers, out: _Numbers) -> None:
    np.dot(inputs, weights.T, out)
    out += bias


@njit_unlocked
def forward(network: Network, observations: _Numbers, rows: Index, layers: Layers) -> None:
    """The layers of some rows of the observations.

    Parameters
    ----------
    network : weights and biases.
    observations : (N, size), normalised.
    rows : (n,) which of them.
    layers : with n rows; inputs, activations and output are filled.
    """
    for i in range(len(rows)):
        # Copied, so that the minibatch is contiguous, as BLAS wants its matrices.
        layers.inputs[i] = observations[rows[i]]
    _layer(layers.inputs, network.first, network.first_bias, layers.first)
    _tanh(layers.first)
    _layer(layers.first, network.second, network.second_bias, layers.second)
    _tanh(layers.second)
    _layer(layers.second, network.last, network.last_bias, layers.output)


@njit_unlocked
def outputs(network: Network, observations: _Numbers, layers: Layers, found: _Numbers) -> None:
    """The network's outputs for all observations.

    Parameters
    ----------
    network : weights and biases.
    observations : (N, size), normalised.
    layers : to work in; their rows are the block that is computed at a time.
    found : (N, outputs) out.
    """
    count, block = len(observations), len(layers.inputs)
    for first in range(0, count, block):
        # The last block is filled with the last row, so that every product has the same shape, and
        # the same rounding.
        rows = np.minimum(np.arange(first, first + block), count - 1)
        forward(network, observations, rows, layers)
        for i in range(min(block, count - first)):
            found[first + i] = layers.output[i]


@njit_unlocked
def _sum_rows(values: _Numbers, sums: _Numbers) -> None:
    sums[:] = 0.0
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            sums[j] += values[i, j]


@njit_unlocked
def _through_tanh(derivatives: _Numbers, activations: _Numbers) -> None:
    for i in range(derivatives.shape[0]):
        for j in range(derivatives.shape[1]):
            # tanh' = 1 - tanh², and the activations are the tanh already.
            derivatives[i, j] *= 1 - activations[i, j] * activations[i, j]


@njit_unlocked
def backward(network: Network, layers: Layers, gradients: Network) -> None:
    """Gradients of a loss by all weights and biases (back-propagation).

    Parameters
    ----------
    network : weights and biases.
    layers : as `forward` has filled them, and with `to_output` (n, outputs), the loss's derivatives
        by the output; `to_second` and `to_first` are filled.
    gradients : out.
    """
    # For each layer, from the last: dL/dW = δᵀ · input, dL/db = sum of δ over the rows, and δ of
    # the layer below is (δ · W) times the slope of tanh there.
    np.dot(layers.to_output.T, layers.second, gradients.last)
    _sum_rows(layers.to_output, gradients.last_bias)
    np.dot(layers.to_output, network.last, layers.to_second)
    _through_tanh(layers.to_second, layers.second)
    np.dot(layers.to_second.T, layers.first, gradients.second)
    _sum_rows(layers.to_second, gradients.second_bias)
    np.dot(layers.to_second, network.second, layers.to_first)
    _through_tanh(layers.to_first, layers.first)
    np.dot(layers.to_first.T, layers.inputs, gradients.first)
    _sum_rows(layers.to_first, gradients.first_bias)


@njit_unlocked
def actor_gradients(
    network: Network,
    observations: _Numbers,
    actions: _Numbers,
    advantages: _Numbers,
    log_probabilities: _Numbers,
    log_std: _Numbers,
    clip_range: float,
    rows: Index,
    layers: Layers,
    gradients: Network,
) -> tuple[float, float]:
    """The clipped surrogate loss of a minibatch (Schulman et al. 2017, equation 7), its gradients,
    and the approximate Kullback-Leibler divergence (Schulman's third estimator).

    Parameters
    ----------
    network : of the actor; its output is the mean action.
    observations, actions, advantages, log_probabilities : (N, size), (N, A), (N,), (N,) of a
        rollout, and of these actions when they were taken.
    log_std : (A,) logarithm of the actions' standard deviation.
    clip_range : ε of the loss: the ratio of probabilities is clipped to 1 - ε ... 1 + ε.
    rows : (n,) of the minibatch; advantages are normalised over them.
    layers : with n rows, to work in.
    gradients : out.

    Returns
    -------
    Loss and divergence, means over the minibatch.
    """
    forward(network, observations, rows, layers)
    n, count = len(rows), actions.shape[1]
    mean = 0.0
    for i in range(n):
        mean += advantages[rows[i]]
    mean /= n
    square = 0.0
    for i in range(n):
        square += (advantages[rows[i]] - mean) ** 2
    # n - 1, as torch's `std` has it, and the same 1e-8.
    deviation = np.sqrt(square / (n - 1)) + 1e-8
    constant = 0.0
    precision = np.empty(count)
    for a in range(count):
        # log π(a|s) = -½ Σ ((a - mean) / σ)² - Σ (log σ + ½ log 2π): 1 / σ² here, the second sum
        # below.
        precision[a] = np.exp(-2.0 * log_std[a])
        constant += log_std[a] + 0.5 * np.log(2.0 * np.pi)
    loss, divergence = 0.0, 0.0
    for i in range(n):
        row = rows[i]
        exponent = 0.0
        for a in range(count):
            # Summed in double precision, whatever the network's: the ratio is an exponential of a
            # difference.
            away = np.float64(actions[row, a]) - np.float64(layers.output[i, a])
            exponent += away * away * precision[a]
        log_ratio = -0.5 * exponent - constant - log_probabilities[row]
        ratio = np.exp(log_ratio)
        advantage = (advantages[row] - mean) / deviation
        clipped = min(max(ratio, 1.0 - clip_range), 1.0 + clip_range)
        # The objective is the smaller of the two products. Where that is the clipped one it is
        # constant, so no gradient flows.
        free = advantage * ratio <= advantage * clipped
        loss -= advantage * (ratio if free else clipped)
        # (r - 1) - log r: never negative, unlike -log r, and with less variance.
        divergence += ratio - 1.0 - log_ratio
        share = -advantage * ratio / n if free else 0.0
        for a in range(count):
            away = np.float64(actions[row, a]) - np.float64(layers.output[i, a])
            # dL/dmean = -A r (a - mean) / σ², because d log π / dmean = (a - mean) / σ².
            layers.to_output[i, a] = share * away * precision[a]
    backward(network, layers, gradients)
    return loss / n, divergence / n


@njit_unlocked
def critic_gradients(
    network: Network,
    observations: _Numbers,
    returns: _Numbers,
    weight: float,
    rows: Index,
    layers: Layers,
    gradients: Network,
) -> float:
    """Mean squared error of the values of a minibatch, and `weight` times its gradients.

    Parameters
    ----------
    network : of the critic; its output is the value of a state.
    observations, returns : (N, size), (N,) of a rollout.
    weight : of the value loss in the whole loss (`vf_coef`).
    rows : (n,) of the minibatch.
    layers : with n rows, to work in.
    gradients : out.

    Returns
    -------
    The mean squared error, without `weight`.
    """
    forward(network, observations, rows, layers)
    n = len(rows)
    loss = 0.0
    for i in range(n):
        away = np.float64(layers.output[i, 0]) - np.float64(returns[rows[i]])
        loss += away * away
        layers.to_output[i, 0] = weight * 2.0 * away / n
    backward(network, layers, gradients)
    return loss / n


@njit_unlocked
def _square(values: _Numbers) -> float:
    flat = values.ravel()
    total = 0.0
    for i in range(flat.size):
        total += np.float64(flat[i]) * flat[i]
    return total


@njit_unlocked
def square_norm(gradients: Network) -> float:
    """Sum of the squares of all `gradients` of a network, in double precision."""
    total = _square(gradients.first) + _square(gradients.first_bias)
    total += _square(gradients.second) + _square(gradients.second_bias)
    total += _square(gradients.last) + _square(gradients.last_bias)
    return float(total)


@njit_unlocked
def adam_step(
    values: _Numbers,
    gradients: _Numbers,
    means: _Numbers,
    squares: _Numbers,
    shrink: float,
    rate: float,
    betas: tuple[float, float],
    epsilon: float,
    step: int,
) -> None:
    """A step of Adam (Kingma, Ba 2015, algorithm 1).

    Parameters
    ----------
    values, gradients : weights or biases of a layer, changed, and of the loss by them.
    means, squares : running means of gradients and their squares, changed.
    shrink : factor on the gradients, where their norm is limited.
    rate : learning rate.
    betas : decay of the two running means per step.
    epsilon : added to the root of the mean square.
    step : number of this step, from 1.
    """
    one, two = betas
    # Bias corrections of both running means. As in torch, ε is added after the second one, to √(v /
    # (1 - β₂ᵗ)): elsewhere it would be another optimiser.
    size = rate / (1.0 - one**step)
    root = np.sqrt(1.0 - two**step)
    x, g, m, v = values.ravel(), gradients.ravel(), means.ravel(), squares.ravel()
    for i in range(x.size):
        gradient = shrink * g[i]
        m[i] = one * m[i] + (1.0 - one) * gradient
        v[i] = two * v[i] + (1.0 - two) * gradient * gradient
        x[i] -= size * m[i] / (np.sqrt(v[i]) / root + epsilon)
