"""Files that stand under their name whole or not at all."""
