"""The bakers as commands of `python -m bth`, one file each."""
