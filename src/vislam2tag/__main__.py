"""``python -m vislam2tag``."""

from vislam2tag.cli import main

if __name__ == "__main__":
    main()
