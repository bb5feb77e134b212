"""``python -m rcstudy``."""

from rcstudy.cli import main

if __name__ == "__main__":
    main()
