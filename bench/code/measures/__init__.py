"""Parts of measure_code.py."""
