"""Contacts, pictures, drafts and relighting."""
