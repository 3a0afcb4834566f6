"""The ablation of the optics replaces values that exist."""

from benchmarks.ablation_features import ablations


def test_every_change_replaces_an_existing_value() -> None:
    for ablation in ablations():
        for change in ablation.changes:
            assert hasattr(change.place, change.name), f"{ablation.name}: {change.name}"
