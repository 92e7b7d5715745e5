"""Pictures that need no caption."""
