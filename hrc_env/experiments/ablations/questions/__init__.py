"""The questions: about rigs, about what goes wrong with cameras, about estimators."""
