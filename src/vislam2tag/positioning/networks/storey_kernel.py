"""A kernel classifier of storeys: ridge regression with a Gaussian kernel on the direction of a scan's powed levels.

Where there are more scans than it can solve for, a drawn part of them spans the solution (Williams and Seeger 2001).
"""

from __future__ import annotations

import torch

EXPONENT = 1.7
MOST_CENTRES = 1500
RIDGE = 1.0
_SMALLEST = 1e-6


class StoreyKernel(torch.nn.Module):  # type: ignore[misc]  # torch counts as Any
    """Scores of storeys, cut to probabilities."""

    def __init__(self, centres: int, inputs: int, storeys: int) -> None:
        super().__init__()
        self.register_buffer("centre", torch.zeros(centres, inputs, dtype=torch.float64))
        self.register_buffer("weight", torch.zeros(centres, storeys, dtype=torch.float64))
        self.register_buffer("prior", torch.zeros(storeys, dtype=torch.float64))

    def fit(self, level: torch.Tensor, copies: torch.Tensor, storey: torch.Tensor) -> None:
        """Solve for scans (n, a), spanned by the first of them, and altered copies (k n, a) in the same order."""
        target = torch.nn.functional.one_hot(storey, len(self.prior)).double()
        self.prior.copy_(target.mean(dim=0))
        self.centre.copy_(_direction(level[: len(self.centre)]))
        among = self._likeness(level[: len(self.centre)])
        normal = RIDGE * among
        right = torch.zeros_like(self.weight)
        for part in (level, *copies.split(len(level))):
            like = self._likeness(part)
            normal += like.T @ like
            right += like.T @ (target - self.prior)
        normal += 1e-6 * torch.eye(len(normal), dtype=normal.dtype)
        self.weight.copy_(torch.linalg.solve(normal, right))

    def forward(self, level: torch.Tensor) -> torch.Tensor:
        """Return probabilities (n, s) for levels (n, a) from 0 to 1."""
        score = (self.prior + self._likeness(level) @ self.weight).clamp(min=1e-3)
        return score / score.sum(dim=1, keepdim=True)

    def _likeness(self, level: torch.Tensor) -> torch.Tensor:
        return torch.exp(2 * (_direction(level) @ self.centre.T - 1))


def _direction(level: torch.Tensor) -> torch.Tensor:
    powed = level.double() ** EXPONENT
    return powed / powed.norm(dim=1, keepdim=True).clamp(min=_SMALLEST)
