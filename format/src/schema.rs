//! Declares the stored structs and derives the schema hash from their very declarations, so that no
//! field can change without changing the hash in the header.

/// FNV-1a over `text`, white space left out (compilers differ in how they space a token list),
/// continuing from `hash`.
pub(crate) const fn hash_text(mut hash: u64, text: &str) -> u64 {
    let bytes = text.as_bytes();
    let mut i = 0;
    while i < bytes.len() {
        if !bytes[i].is_ascii_whitespace() {
            hash ^= bytes[i] as u64;
            hash = hash.wrapping_mul(0x0000_0100_0000_01B3);
        }
        i += 1;
    }
    hash
}

/// A stored struct can name its own layout.
pub trait Described {
    /// Its declaration: name, then fields with their types.
    const DECLARATION: &'static str;
}

macro_rules! schema {
    ($(#[doc = $doc:literal])* #[derive(Copy)] pod struct $name:ident {
        $($(#[doc = $field_doc:literal])* pub $field:ident : $type:ty,)*
    }) => {
        $(#[doc = $doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, rkyv::Archive, rkyv::Serialize)]
        #[rkyv(attr(derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)))]
        #[rkyv(attr(doc = concat!("The stored form of [`", stringify!($name), "`].")))]
        #[allow(missing_docs)]
        pub struct $name {
            $($(#[doc = $field_doc])* pub $field: $type,)*
        }
        impl crate::schema::Described for $name {
            const DECLARATION: &'static str =
                concat!(stringify!($name), "{", $(stringify!($field), ":", stringify!($type), ",",)* "}");
        }
    };
    ($(#[doc = $doc:literal])* struct $name:ident {
        $($(#[doc = $field_doc:literal])* pub $field:ident : $type:ty,)*
    }) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, Default, PartialEq, rkyv::Archive, rkyv::Serialize)]
        #[rkyv(attr(doc = concat!("The stored form of [`", stringify!($name), "`].")))]
        #[allow(missing_docs)]
        pub struct $name {
            $($(#[doc = $field_doc])* pub $field: $type,)*
        }
        impl crate::schema::Described for $name {
            const DECLARATION: &'static str =
                concat!(stringify!($name), "{", $(stringify!($field), ":", stringify!($type), ",",)* "}");
        }
    };
}
pub(crate) use schema;

/// Hash of every stored struct's declaration.
pub const SCHEMA_HASH: u64 = {
    use crate::types::*;
    let mut hash = 0xCBF2_9CE4_8422_2325;
    hash = hash_text(hash, Object::DECLARATION);
    hash = hash_text(hash, Bounds::DECLARATION);
    hash = hash_text(hash, ObjectBounds::DECLARATION);
    hash = hash_text(hash, Mesh::DECLARATION);
    hash = hash_text(hash, BvhNode::DECLARATION);
    hash = hash_text(hash, BvhStats::DECLARATION);
    hash = hash_text(hash, Bvh::DECLARATION);
    hash = hash_text(hash, ObjectSource::DECLARATION);
    hash = hash_text(hash, Camera::DECLARATION);
    hash = hash_text(hash, SourceFile::DECLARATION);
    hash = hash_text(hash, ReferencedFile::DECLARATION);
    hash_text(hash, Scene::DECLARATION)
};
